"""Lamps that answer the light of a room, and what Mitsuba itself makes of the same materials."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from purelight_export.graph import Graph
from purelight_format.members.finishes import Finish
from tests.support import analytic_lamps as lamps
from tests.support import twins
from tests.support.analytic_lamps import Lamp

PAINT = (0.7, 0.5, 0.2)
MATT = Finish("matt", PAINT, ior=1.0)
WHITE_METAL = Finish("rough", (1.0, 1.0, 1.0), metalness=1.0, roughness=0.5)
MIRROR = Finish("polished", (1.0, 1.0, 1.0), metalness=1.0, roughness=0.0)
PANE = Finish("pane", (0.0, 0.0, 0.0), roughness=0.0, opacity=0.0, thin_walled=True)
STOCK: dict[str, dict[str, Any]] = {
    "matt": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(PAINT)}},
    "rough": {
        "type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": 0.25,
    },
    "polished": {"type": "conductor", "material": "none"},
}  # fmt: skip


def finished(lamp: Lamp, *finishes: Finish) -> Lamp:
    """A lamp all of the first finish, on both sides."""
    sides = np.zeros((len(lamp.surface.triangles), 2), np.uint8)
    return replace(lamp, surface=replace(lamp.surface, finish=sides), finishes=finishes)


@dataclass(frozen=True)
class FinishedBall:
    """An opaque ball that shines evenly, of one material; convex, so it never lights itself."""

    finish: Finish
    tilt: float = 0.0

    def lamp(self) -> Lamp:
        return finished(lamps.ball(self.tilt), self.finish)

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        return lamps.mitsuba_lamps(
            self.lamp(), folder, to_world, tilt=self.tilt, dimmer=dimmer,
            bsdf=STOCK[self.finish.name],
        )  # fmt: skip


@dataclass(frozen=True)
class Window:
    """A dark sheet of glass that mirrors as much as it does not let through."""

    def lamp(self) -> Lamp:
        dark = twins.Panel(level=0.0, through=(1.0, 1.0, 1.0)).lamp()
        networks = dark.networks | {"transparency": _pane()}
        return finished(replace(dark, networks=networks), PANE)

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        panel = twins.Panel(level=0.0, through=(1.0, 1.0, 1.0)).stock(folder, to_world, dimmer)
        return {"pane": panel["panel"] | {"bsdf": {"type": "thindielectric", "int_ior": PANE.ior}}}


@dataclass(frozen=True)
class Bubble:
    """A dark hollow ball of thin glass, which mirrors on its far side too."""

    def lamp(self) -> Lamp:
        ball = lamps.ball()
        networks = {"appearance": lamps.black(), "transparency": _pane(walls=2)}
        surface = replace(ball.surface, triangle_flux=0 * ball.surface.triangle_flux)
        return finished(lamps.Lamp(surface, networks, np.zeros(3)), PANE)

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        glass = {"type": "thindielectric", "int_ior": PANE.ior}
        shapes = lamps.mitsuba_lamps(self.lamp(), folder, to_world, dimmer=0.0, bsdf=glass)
        return {name: {k: v for k, v in s.items() if k != "emitter"} for name, s in shapes.items()}


def _pane(walls: int = 1) -> bytes:
    """transmittance = (1 - 2 F / (1 + F)) with Fresnel's F, as often as there are walls."""
    graph, ior = Graph("transparency"), PANE.ior
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    c = graph.sum(normal * outgoing)
    c = graph.maximum(c, -c)
    g = graph.sqrt(c * c + (ior * ior - 1))
    along = (g - c) / (g + c)
    inner = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    f = along * along * (inner * inner + 1.0) * 0.5
    one = 1.0 - f * 2.0 / (f + 1.0)
    graph.output("transmittance", position * 0.0 + (one * one if walls == 2 else one))
    return graph.to_bytes()
