"""Lights of KHR_lights_punctual."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMENS_PER_WATT
from purelight_import.model.lamp import PointLight
from purelight_import.read.build import Builder
from purelight_import.read.gltf.document import Document
from purelight_import.read.gltf.nodes import Placed

EXTENSION = "KHR_lights_punctual"


def add_light(document: Document, placed: Placed, builder: Builder) -> None:
    """Adds the light of a node, if it has one; directional ones are the room's."""
    reference = placed.node.get("extensions", {}).get(EXTENSION)
    if not reference:
        return
    lights = document.json.get("extensions", {}).get(EXTENSION, {}).get("lights", [])
    index = reference["light"]
    if not isinstance(index, int) or not 0 <= index < len(lights):
        raise ValueError(f"lights[{index}] is not there")
    about = lights[index]
    name = str(about.get("name") or placed.path[-1] or f"light_{index}")
    kind, intensity = about.get("type"), float(about.get("intensity", 1))
    if kind == "directional":
        builder.room.append(name)
        return
    if kind not in ("point", "spot") or not intensity > 0:
        return
    color = np.array(about.get("color", (1, 1, 1)), np.float64)
    r, g, b = (np.maximum(color, 0) * intensity / LUMENS_PER_WATT).tolist()
    cone = None
    if kind == "spot":
        spot = about.get("spot", {})
        outer = float(spot.get("outerConeAngle", np.pi / 4))
        cone = (min(float(spot.get("innerConeAngle", 0)), outer), outer)
    if not np.isfinite([r, g, b]).all():
        raise ValueError("a light's colour is no number")
    builder.points.append(
        PointLight(
            builder.name(name, "light"), placed.to_world[:3, 3].copy(), (r, g, b),
            _forward(placed.to_world), cone, tuple(filter(None, (*placed.path, name))),
        )
    )  # fmt: skip


def _forward(to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lights shine along -Z of their node."""
    forward: NDArray[np.float64] = -to_world[:3, 2]
    return forward / (np.linalg.norm(forward) or 1.0)
