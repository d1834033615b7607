"""What an export lets choose, known without loading Torch."""

from __future__ import annotations

from purelight_format.networks.kinds import KINDS

BROUGHT = {name for kind in KINDS.values() for name in kind.needs}
NETWORKS = tuple(name for name in KINDS if name not in BROUGHT)
IES, EULUMDAT = PHOTOMETRIC = ("ies", "ldt")
