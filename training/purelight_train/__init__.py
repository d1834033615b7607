"""Light-trace a luminaire once, and train the networks of its bundle.

Torch is loaded with the first of these names (`threads.use` first, to choose its threads), and
Mitsuba needs a variant before (`purelight_mitsuba.use`).
"""

from __future__ import annotations

from purelight_format import lazy

_HOMES = {
    "PRESETS": "presets",
    "Preset": "presets",
    "RunDirectory": "runs.run_directory",
    "Training": "runs.pipeline",
    "reopen": "runs.pipeline",
    "start": "runs.pipeline",
}
__all__ = list(_HOMES)
__getattr__ = lazy.attributes(__name__, _HOMES)
