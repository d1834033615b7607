"""`catalogue.usda`: all lamps of a catalogue, side by side and as variants of one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from purelight_catalogue.catalogue import Card
from purelight_format import atomic

GAP = 1.5  # between two lamps, in widths of the largest


def prim_name(name: str) -> str:
    """A lamp's name as USD allows it."""
    return "lamp_" + re.sub(r"[^a-z0-9]", "_", name)


def write_stage(cards: Sequence[Card], output: Path) -> Path | None:
    """Write the stage; None if no lamp is there.

    `/Catalogue` holds every lamp on a grid; `/Lamp` is one of them, by its variant set `lamp`.
    Both are references to the lamps' own USD assets.
    """
    shown = [card for card in cards if not card.fault and "usda" in card.files]
    if not shown:
        return None
    layer = _layer(shown)
    path = output / "catalogue.usda"
    atomic.write_bytes(path, layer.ExportToString().encode())
    return path


def _layer(shown: Sequence[Card]) -> Any:
    """The stage's layer: specs, since a stage would look for the lamps while it is written."""
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = "Lamps of a PureLight catalogue; /Lamp is any of them, by its variant"
    layer.defaultPrim = "Catalogue"
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    layer.pseudoRoot.SetInfo("upAxis", "Z")
    grid = Sdf.PrimSpec(layer, "Catalogue", Sdf.SpecifierDef, "Xform")
    single = Sdf.PrimSpec(layer, "Lamp", Sdf.SpecifierClass)
    single.variantSetNameList.Append("lamp")
    choices = Sdf.VariantSetSpec(single, "lamp")
    step = GAP * max(2 * card.about["manifest"]["bounding_sphere"]["radius"] for card in shown)
    columns = math.ceil(math.sqrt(len(shown)))
    for number, card in enumerate(shown):
        name, asset = prim_name(card.entry.name), Sdf.Reference(f"./{card.files['usda']}")
        place = Sdf.PrimSpec(grid, name, Sdf.SpecifierDef, "Xform")
        kinds = Sdf.ValueTypeNames
        order = Sdf.AttributeSpec(place, "xformOpOrder", kinds.TokenArray, Sdf.VariabilityUniform)
        order.default = ["xformOp:translate"]
        translate = Sdf.AttributeSpec(place, "xformOp:translate", kinds.Double3)
        translate.default = (step * (number % columns), -step * (number // columns), 0.0)
        lamp = Sdf.PrimSpec(place, "lamp", Sdf.SpecifierDef)
        lamp.referenceList.Prepend(asset)
        Sdf.VariantSpec(choices, name).primSpec.referenceList.Prepend(asset)
    single.variantSelections["lamp"] = prim_name(shown[0].entry.name)
    return layer
