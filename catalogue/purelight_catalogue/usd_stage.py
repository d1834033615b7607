"""`catalogue.usda`: all lamps of a catalogue, side by side and as variants of one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

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
    from pxr import Sdf, Usd, UsdGeom

    shown = [card for card in cards if "usda" in card.files]
    if not shown:
        return None
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetMetadata("comment", "Lamps of a PureLight catalogue; /Lamp has them as variants")
    stage.SetDefaultPrim(stage.DefinePrim("/Catalogue", "Xform"))
    step = GAP * max(2 * card.about["manifest"]["bounding_sphere"]["radius"] for card in shown)
    columns = math.ceil(math.sqrt(len(shown)))
    single = stage.CreateClassPrim(Sdf.Path("/Lamp"))
    choices = single.GetVariantSets().AddVariantSet("lamp")
    for number, card in enumerate(shown):
        asset, name = f"./{card.files['usda']}", prim_name(card.entry.name)
        place = UsdGeom.Xform.Define(stage, f"/Catalogue/{name}")
        place.AddTranslateOp().Set((step * (number % columns), -step * (number // columns), 0.0))
        stage.DefinePrim(f"/Catalogue/{name}/lamp").GetReferences().AddReference(asset)
        choices.AddVariant(name)
        choices.SetVariantSelection(name)
        with choices.GetVariantEditContext():
            single.GetReferences().AddReference(asset)
    choices.SetVariantSelection(prim_name(shown[0].entry.name))
    path = output / "catalogue.usda"
    atomic.write_bytes(path, stage.GetRootLayer().ExportToString().encode())
    return path
