"""PureLight's luminaires in Mitsuba 3.

Import this package before `mitsuba` and `drjit` (it finds an LLVM that they can use). Once a
variant is set, by `purelight_mitsuba.use()` or by `mi.set_variant("llvm_ad_rgb")`, scenes may
contain the emitter and the integrator `purelight`. Each variant has modules of its own
(`module_sets`): what is imported from this package belongs to the variant in use at that time.
"""

from __future__ import annotations

from purelight_mitsuba.platform import prepare, use
from purelight_mitsuba.registration import follow, register

__all__ = ["register", "use"]

prepare()
follow()
