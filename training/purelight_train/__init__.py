"""Light-trace a luminaire once, and train the networks of its bundle.

Torch is loaded with the first of these names, and Mitsuba needs a variant before
(`purelight_mitsuba.use`).
"""

from __future__ import annotations

from purelight_format import lazy
from purelight_train import threads as threads  # Before Torch: how its threads wait

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
