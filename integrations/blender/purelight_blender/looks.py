"""Which look a lamp has: its networks where OSL runs, else an IES light and a baked look."""

from __future__ import annotations

from typing import Any

import bpy

from . import ies_light
from .looks_text import NOTE as NOTE
from .scene import is_lamp, lamps

STATE = "purelight_state"  # Of an object: the look that it has been given.
CROSSINGS = 64  # Transparent bounces; Cycles has 8, and what is beyond is black.
NETWORKS, SIMPLE = "networks", "simple"


def obstacle(scene: Any) -> str:
    """Why OSL does not run in a scene, in one line; empty if it does."""
    if scene.render.engine != "CYCLES":
        return "only Cycles runs OSL: choose Cycles as render engine"
    if scene.cycles.device == "GPU" and compute_device() != "OPTIX":
        return "OSL runs on the CPU and on OptiX alone: set Cycles' device to CPU"
    if not scene.cycles.shading_system:
        return "Open Shading Language is off in Cycles' render properties"
    return ""


def compute_device() -> str:
    """The kind of GPU that Cycles is set to."""
    addon = bpy.context.preferences.addons.get("cycles")
    return str(addon.preferences.compute_device_type) if addon else "NONE"


def switch_on(scene: Any) -> None:
    """Turns OSL on, and lets rays cross as many surfaces as a lamp may have."""
    if hasattr(scene, "cycles"):
        scene.cycles.shading_system = True
        most = scene.cycles.transparent_max_bounces
        scene.cycles.transparent_max_bounces = max(most, CROSSINGS)


def fit(scene: Any) -> None:
    """Gives every lamp of a scene the look that its renderer can show."""
    state = SIMPLE if obstacle(scene) else NETWORKS
    for thing in lamps(scene):
        if thing.library is None and thing.override_library is None:
            _give(thing, state)


def _give(thing: Any, state: str) -> None:
    """The mesh lights the room by itself, or leaves that to its light."""
    if state == SIMPLE:
        ies_light.ensure(thing)
    else:
        ies_light.remove(thing)
    if thing.get(STATE) != state:
        thing[STATE] = state
        thing.visible_diffuse = thing.visible_shadow = state == NETWORKS


def scaling_fault(thing: Any) -> str:
    """What is wrong with how a lamp is scaled; empty if nothing is."""
    if not is_lamp(thing):
        return ""
    columns = [column.to_3d() for column in thing.matrix_world.col[:3]]
    sizes = [column.length for column in columns]
    straight = all(
        abs(columns[i].dot(columns[j])) < 1e-4 * sizes[i] * sizes[j]
        for i, j in ((0, 1), (0, 2), (1, 2))
    )
    if not straight or max(sizes) > 1.0001 * min(sizes) or not min(sizes) > 0:
        return "scaled unevenly or sheared: its light is wrong"
    if thing.matrix_world.determinant() < 0:
        return "mirrored: its light is wrong"
    return ""
