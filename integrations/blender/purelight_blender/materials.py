"""The materials of a lamp: a node group that asks the networks, a material for each flux bin."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from purelight_format.errors import PureLightError

from . import tables
from .lamp import Lamp
from .nodes import Tree

DIMMER, TINT, LOOK = "purelight_dimmer", "purelight_tint", "purelight_look"
SCRIPT, TABLES = "PureLight networks", "PureLight tables"  # Names of nodes.


def materials(lamp: Lamp) -> list[Any]:
    """A material for each bin, over one group.

    Raises:
        PureLightError: If Blender cannot compile the lamp's OSL, or tables cannot be written.
    """
    group = _group(lamp)
    return [_material(lamp, group, index) for index in range(len(lamp.bins.strength))]


def _material(lamp: Lamp, group: Any, index: int) -> Any:
    material = bpy.data.materials.new(f"{lamp.name} {index + 1}" if index else lamp.name)
    material.use_nodes = True
    tree = Tree(material.node_tree)
    tree.tree.nodes.clear()
    asked = tree.add("Group", node_tree=group)
    asked.inputs["Strength"].default_value = float(lamp.bins.strength[index])
    for target, output in (("CYCLES", "Cycles"), ("EEVEE", "EEVEE")):
        node = tree.add("OutputMaterial", target, target=target)
        tree.link(asked.outputs[output], node.inputs["Surface"])
    material.cycles.emission_sampling = lamp.bins.sides[index]
    bright = lamp.flux / max(lamp.flux.max(), 1e-30)
    material.diffuse_color = (*bright, 1.0)
    return material


def _group(lamp: Lamp) -> Any:
    group = bpy.data.node_groups.new(f"PureLight {lamp.name}", "ShaderNodeTree")
    _sockets(group)
    tree = Tree(group)
    given, out = tree.add("NodeGroupInput"), tree.add("NodeGroupOutput")
    script = _script(tree, lamp)
    factor = _factor(tree, given)
    look = tree.add("Attribute", "baked look", attribute_name=LOOK).outputs["Color"]
    clear = tree.constant(np.sqrt(lamp.clear), "baked transmittance")
    ready = script.outputs["Ready"]
    light = tree.mixed(ready, look, script.outputs["Radiance"])
    through = tree.mixed(ready, clear, script.outputs["Transmittance"])
    strength = given.outputs["Strength"]
    for name, colour, passed in (("Cycles", light, through), ("EEVEE", look, clear)):
        scaled = tree.vector("DIVIDE", tree.vector("MULTIPLY", colour, factor), strength)
        tree.link(_closure(tree, scaled, strength, None if lamp.opaque else passed),
                  out.inputs[name])  # fmt: skip
    return group


def _sockets(group: Any) -> None:
    add = group.interface.new_socket
    for name, kind, value in (
        ("Strength", "NodeSocketFloat", 1.0),
        ("Dimmer", "NodeSocketFloat", 1.0),
        ("Tint", "NodeSocketColor", (1.0, 1.0, 1.0, 1.0)),
    ):
        add(name, in_out="INPUT", socket_type=kind).default_value = value
    for name in ("Cycles", "EEVEE"):
        add(name, in_out="OUTPUT", socket_type="NodeSocketShader")


def _factor(tree: Tree, given: Any) -> Any:
    """Dimmer and tint, those of the material times those of each object."""
    own = [
        tree.add("Attribute", name, attribute_type="INSTANCER", attribute_name=name)
        for name in (DIMMER, TINT)
    ]
    both = tree.vector("MULTIPLY", given.outputs["Tint"], given.outputs["Dimmer"])
    each = tree.vector("MULTIPLY", own[1].outputs["Color"], own[0].outputs["Fac"])
    return tree.vector("MULTIPLY", both, each)


def _closure(tree: Tree, colour: Any, strength: Any, passed: Any) -> Any:
    emission = tree.add("Emission")
    tree.link(colour, emission.inputs["Color"])
    tree.link(strength, emission.inputs["Strength"])
    if passed is None:
        return emission.outputs[0]
    clear, both = tree.add("BsdfTransparent"), tree.add("AddShader")
    tree.link(passed, clear.inputs["Color"])
    tree.link(emission.outputs[0], both.inputs[0])
    tree.link(clear.outputs[0], both.inputs[1])
    return both.outputs[0]


def _script(tree: Tree, lamp: Lamp) -> Any:
    """The node with the networks; next to it the image that keeps their tables in the .blend."""
    text = bpy.data.texts.new(f"{lamp.name}.osl")
    text.from_string(lamp.shader)
    node = tree.add("Script", SCRIPT, mode="INTERNAL", script=text)
    node.name = SCRIPT
    _compile(node)
    if lamp.texels is not None:
        image = tables.packed(lamp.texels, lamp.digest, f"{lamp.name} tables")
        kept = tree.add("TexImage", TABLES, image=image)
        kept.name = TABLES
        node.inputs["Tables"].default_value = str(tables.file_of(image))
    return node


def _compile(node: Any) -> None:
    """Makes the sockets of the node."""
    from cycles import osl

    said: list[str] = []
    osl.update_script_node(node, lambda kind, text: said.append(text))
    if "Ready" not in node.outputs:
        reason = said[-1] if said else "it gave no reason"
        raise PureLightError(f"Cycles cannot compile the lamp's OSL: {reason}")
