"""The light that stands in for a lamp where no OSL runs: a point light with the lamp's flux.

In Cycles it has the shape of the lamp's IES file; EEVEE knows no IES files and shines evenly.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.reader import read_ies

from .materials import DIMMER, TINT
from .scene import FLUX, PHOTOMETRY, SPHERE

OURS = "purelight_stand_in"
SIZE = 0.25  # Of the bounding sphere's radius.
# Cycles turns candela into W by lumens of an even white, and W/sr into W of a whole sphere.
LUMENS_PER_WATT = 177.83


def ensure(thing: Any) -> Any:
    """The light of a lamp's object, made if there is none."""
    found = next((child for child in thing.children if OURS in child), None)
    return found or _new(thing)


def remove(thing: Any) -> None:
    """Takes the light of a lamp's object away."""
    for child in list(thing.children):
        if OURS in child:
            bpy.data.lights.remove(child.data)


def _new(thing: Any) -> Any:
    mesh = thing.data
    x, y, z, radius = mesh[SPHERE]
    light = bpy.data.lights.new(f"{thing.name} light", "POINT")
    light.shadow_soft_size = SIZE * radius
    light.use_custom_distance = False
    flux = np.array(mesh[FLUX])
    _drive(light, thing, flux)
    made = bpy.data.objects.new(light.name, light)
    made[OURS] = True
    made.parent, made.location = thing, (x, y, z)
    made.visible_camera = made.visible_glossy = made.visible_transmission = False
    for collection in thing.users_collection:
        collection.objects.link(made)
    if PHOTOMETRY in mesh and mesh[PHOTOMETRY] is not None:
        _shape(light, mesh[PHOTOMETRY])
    return made


def _drive(light: Any, thing: Any, flux: np.ndarray) -> None:
    """Power and colour follow the dimmer, the tint and the scale of the lamp in the world."""
    power = float(flux.max())
    share = flux / power if power > 0 else np.zeros(3)  # A black lamp has a black light.
    driver = light.driver_add("energy").driver
    _variable(driver, "dimmer", thing, f'["{DIMMER}"]')
    size = driver.variables.new()
    size.name, size.type = "scale", "TRANSFORMS"
    size.targets[0].id, size.targets[0].transform_type = thing, "SCALE_AVG"
    size.targets[0].transform_space = "WORLD_SPACE"
    driver.expression = f"{power!r} * dimmer * scale * scale"
    for channel in range(3):
        driver = light.driver_add("color", channel).driver
        _variable(driver, "tint", thing, f'["{TINT}"][{channel}]')
        driver.expression = f"{float(share[channel])!r} * tint"


def _variable(driver: Any, name: str, thing: Any, path: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.targets[0].id, variable.targets[0].data_path = thing, path


def _shape(light: Any, text: Any) -> None:
    """The IES file's shape, its mean over all directions made one.

    Cycles has horizontal 0 along -Y and turns clockwise from there, LM-63 as we write it along +X
    and against the clock: what is at h for Cycles is at 270 - h for us.
    """
    try:
        table = read_ies(text.as_string().encode("latin-1"), text.name)
        mean = table.flux / (4 * np.pi)
    except PureLightError:
        return  # The validator has looked at it; what it lets pass and we cannot read is even.
    if not mean > 0:
        return
    light.use_nodes = True
    tree = light.node_tree
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    ies = tree.nodes.new("ShaderNodeTexIES")
    ies.mode, ies.ies = "INTERNAL", text
    tree.links.new(_turned(tree), ies.inputs["Vector"])
    ies.inputs["Strength"].default_value = LUMENS_PER_WATT / (4 * np.pi * mean)
    tree.links.new(ies.outputs["Fac"], emission.inputs["Strength"])


def _turned(tree: Any) -> Any:
    """The direction (-y, -x, z) of the light, by which Cycles finds our horizontal angle."""
    direction = tree.nodes.new("ShaderNodeTexCoord").outputs["Normal"]
    parts, joined = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeCombineXYZ")
    turn = tree.nodes.new("ShaderNodeVectorMath")
    turn.operation = "MULTIPLY"
    turn.inputs[1].default_value = (-1.0, -1.0, 1.0)
    tree.links.new(direction, turn.inputs[0])
    tree.links.new(turn.outputs["Vector"], parts.inputs[0])
    for ours, cycles in (("X", "Y"), ("Y", "X"), ("Z", "Z")):
        tree.links.new(parts.outputs[ours], joined.inputs[cycles])
    return joined.outputs[0]
