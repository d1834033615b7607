"""Keeps PureLight's plugins registered in whichever variant of Mitsuba is in use."""

from __future__ import annotations

import importlib
from typing import Any

from purelight_mitsuba.module_sets import ModuleSets
from purelight_mitsuba.platform import check_llvm

NAME, ROOM_ONLY = "purelight", "purelight_room_only"
EMITTER_PROPERTIES = ("filename", "to_world", "dimmer")
_modules = ModuleSets("purelight_mitsuba")
_registered: set[str] = set()


def register() -> None:
    """Brings in the modules of the variant in use, and registers its plugins, once for each.

    A plugin's class derives from one of the variant's own, so another variant needs it anew; only
    variants `*_ad_rgb` get plugins.

    Raises:
        PureLightError: If the variant is an LLVM one, and Dr.Jit loaded an LLVM it cannot use.
    """
    mi = importlib.import_module("mitsuba")
    variant = mi.variant()
    if variant is None:
        return
    _modules.switch(variant)
    if not variant.endswith("_ad_rgb") or variant in _registered:
        return
    if variant.startswith("llvm"):
        check_llvm()
    emitter, room_only, integrator = (
        importlib.import_module(f"purelight_mitsuba.{name}")
        for name in ("lamps.emitter", "lamps.room_only", "transport.integrator")
    )

    def make(props: Any) -> Any:
        """Mitsuba keeps one constructor per name, so this one makes emitter and integrator."""
        if any(name in props for name in EMITTER_PROPERTIES):
            return emitter.PureLightEmitter(props)
        return integrator.PureLightIntegrator(props)

    mi.register_emitter(NAME, make)
    mi.register_emitter(ROOM_ONLY, room_only.RoomOnlyEmitter)
    mi.register_integrator(NAME, make)
    _registered.add(variant)


def follow() -> None:
    """Registers the plugins now, and whenever another variant is set."""
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:  # `use` says what to install.
        return
    mi.detail.add_variant_callback(lambda *_: register())
    register()
