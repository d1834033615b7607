"""The list of a lamp's parts, for people and for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from purelight_format.color import lumens
from purelight_format.issues import plain
from purelight_import.model.lamp import Part
from purelight_import.model.material import Verbatim
from purelight_import.model.picture import Picture
from purelight_import.parts.emitters import MILLIMETRES, flux, mean_radiance
from purelight_import.write import bsdf

WIDEST, LAST = 36, 8  # characters of a name, and of its end, which tells pieces apart


def rows(parts: Sequence[Part]) -> list[dict[str, Any]]:
    """One record for each part: name, material, size in metres, triangles, light."""
    return [_row(part) for part in parts]


def _row(part: Part) -> dict[str, Any]:
    low, high = part.mesh.bounds
    row: dict[str, Any] = {
        "name": part.name, "path": list(part.path), "material": part.material.name,
        "is": _kind(part), "triangles": len(part.mesh.triangles),
        "size": np.round(high - low, 6).tolist(),
        "center": np.round(0.5 * (low + high), 6).tolist(),
    }  # fmt: skip
    if part.radiance is not None:
        row["lumens"] = float(f"{lumens(flux(part, part.radiance)):.6g}")
        row["radiance"] = [float(f"{v:.6g}") for v in mean_radiance(part, part.radiance)]
        row["textured"] = isinstance(part.radiance, Picture)
    return row


def _kind(part: Part) -> str:
    if isinstance(part.material, Verbatim):
        return "glass, as in the file" if part.material.glass else "as in the file"
    return bsdf.words(part.material, solid=part.solid)


def text(records: Sequence[dict[str, Any]]) -> str:
    """The records as a table, sizes and places in millimetres."""
    head = ("part", "material", "is", "triangles", "size in mm", "middle in mm", "light")
    lines = [head, *(_cells(row) for row in records)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    size = " x ".join(f"{MILLIMETRES * s:.4g}" for s in row["size"])
    middle = " ".join(str(round(MILLIMETRES * c)) for c in row["center"])
    light = f"{row['lumens']:.4g} lm" if "lumens" in row else ""
    return (
        _short(row["name"]), _short(row["material"]), row["is"], f"{row['triangles']:,}", size,
        middle, light,
    )  # fmt: skip


def _short(name: str) -> str:
    name = plain(name)
    return name if len(name) <= WIDEST else f"{name[: WIDEST - LAST - 1]}…{name[-LAST:]}"
