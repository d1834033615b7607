"""Emitter plugins of training, for whichever variant of Mitsuba is in use."""

from __future__ import annotations

import importlib
import sys
from typing import Any

import mitsuba as mi

MODULE = "purelight_train.light.ray_emitter"


def ray_file_plugin() -> Any:
    """The class of `ray_file` emitters, made known to Mitsuba.

    It derives from a class of the variant in use, and so is made anew for another one.
    """
    module = sys.modules.get(MODULE)
    if module is None:
        module = importlib.import_module(MODULE)
    elif mi.variant() != module.VARIANT:
        module = importlib.reload(module)
    mi.register_emitter(module.NAME, module.RayFileEmitter)
    return module.RayFileEmitter
