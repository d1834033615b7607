"""PureLight's luminaires in Mitsuba 3.

Import this package before `mitsuba` and `drjit` (it finds an LLVM that they can use). Once a
variant is set, by `purelight_mitsuba.use()` or by `mi.set_variant("llvm_ad_rgb")`, scenes may
contain the emitter and the integrator `purelight`. Each variant has modules of its own
(`module_sets`): what is imported from this package belongs to the variant in use at that time.
Only `use` and `register` can be had before.
"""

from __future__ import annotations

from purelight_format import lazy
from purelight_mitsuba.platform import prepare, use
from purelight_mitsuba.registration import follow, register

_HOMES = {
    "Luminaire": "lamps.luminaire",
    "PureLightEmitter": "lamps.emitter",
    "PureLightIntegrator": "transport.integrator",
    "layers": "output.first_hit",
    "load_usd": "usd_scene",
    "render_passes": "output.passes",
}
__all__ = ["register", "use"]
__all__ += list(_HOMES)
__getattr__ = lazy.attributes(__name__, _HOMES)

prepare()
follow()
