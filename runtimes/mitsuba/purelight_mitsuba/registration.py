"""Keeps PureLight's plugins registered in whichever variant of Mitsuba is in use."""

from __future__ import annotations

import importlib
import sys
from typing import Any

from purelight_mitsuba.platform import check_llvm

NAME, ROOM_ONLY = "purelight", "purelight_room_only"
MODULES = ("emitter", "lamps", "room_only", "stock", "aimed", "queued", "integrator")
EMITTER_PROPERTIES = ("filename", "to_world", "dimmer")
_registered: list[str] = []


def register() -> None:
    """Registers the plugins for the variant in use, once.

    A plugin's class derives from one of the variant's own, so another variant needs it anew.

    Raises:
        PureLightError: If the variant is an LLVM one, and Dr.Jit loaded an LLVM it cannot use.
    """
    variant = importlib.import_module("mitsuba").variant()
    if variant is None or not variant.endswith("_ad_rgb") or _registered == [variant]:
        return
    if variant.startswith("llvm"):
        check_llvm()
    emitter, _, room_only, *_, integrator = (_fresh(f"purelight_mitsuba.{n}") for n in MODULES)

    def make(props: Any) -> Any:
        """Mitsuba keeps one constructor per name, so this one makes emitter and integrator."""
        if any(name in props for name in EMITTER_PROPERTIES):
            return emitter.PureLightEmitter(props)
        return integrator.PureLightIntegrator(props)

    mi = importlib.import_module("mitsuba")
    mi.register_emitter(NAME, make)
    mi.register_emitter(ROOM_ONLY, room_only.RoomOnlyEmitter)
    mi.register_integrator(NAME, make)
    _registered[:] = [variant]


def follow() -> None:
    """Registers the plugins now, and whenever another variant is set."""
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:  # `use` says what to install.
        return
    mi.detail.add_variant_callback(lambda *_: register())
    register()


def _fresh(name: str) -> Any:
    loaded = sys.modules.get(name)
    return importlib.import_module(name) if loaded is None else importlib.reload(loaded)
