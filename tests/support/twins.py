"""Scenes made twice: with PureLight's lamps, and with emitters that Mitsuba itself renders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import trimesh

from purelight_export.graph import Graph
from purelight_format.members.surface import Surface
from tests.support import analytic_lamps as lamps
from tests.support.analytic_lamps import CENTRE, COLOUR, RADIUS, Lamp

T = mi.ScalarTransform4f
SIDE = RADIUS / math.sqrt(2)  # Half of a panel's, whose corners touch the bounding sphere.
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
TWO_SIDED_BLACK = {"type": "twosided", "bsdf": BLACK}


@dataclass(frozen=True)
class Ball:
    """An opaque ball that fills its bounding sphere and shines evenly."""

    tilt: float = 0.0
    learned: bool = True

    def lamp(self) -> Lamp:
        return lamps.ball(self.tilt, learned=self.learned)

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        return lamps.mitsuba_lamps(self.lamp(), folder, to_world, tilt=self.tilt, dimmer=dimmer)


@dataclass(frozen=True)
class Panel:
    """A square that shines downward by a power of the cosine and may let light through.

    Arguments:
        level: Factor on the radiance.
        exponent: 0, or 4 for a lobe.
        through: Transmittance per channel, either way.
        flux_on: How the stated flux is divided between its two triangles.
    """

    level: float = 1.0
    exponent: int = 0
    through: tuple[float, ...] | None = None
    flux_on: tuple[float, float] = (0.5, 0.5)

    def lamp(self) -> Lamp:
        corners = np.array([[x, y, 0] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) * SIDE
        flux = 4 * SIDE**2 * 2 * math.pi / (self.exponent + 2) * COLOUR * self.level
        shares = (flux * np.array(self.flux_on)[:, None]).astype(np.float32)
        triangles = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
        surface = Surface((corners + CENTRE).astype(np.float32), triangles, shares)
        networks = {"appearance": self._appearance(), "fast_map": lamps.fast_map([0, 0, 0])}
        networks |= {"sampler": lamps.sampler(), "sampler_pdf": lamps.sampler_pdf()}
        if self.through:
            networks["transparency"] = lamps.transparency(self.through)
        return Lamp(surface, networks, flux)

    def _appearance(self) -> bytes:
        graph = Graph("appearance")
        *_, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
        cosine = graph.relu(-graph.slice(outgoing, 2, 3))
        square = cosine * cosine
        factor = square * square if self.exponent else graph.sign(cosine)
        graph.output("radiance", factor * (COLOUR * self.level))
        return graph.to_bytes()

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        radiance = {"type": "rgb", "value": list(COLOUR * self.level * dimmer)}
        emitter = {"type": "lobe" if self.exponent else "area", "radiance": radiance}
        local = T().translate(list(CENTRE)).rotate([1, 0, 0], 180).scale(SIDE)
        shape = {"type": "rectangle", "to_world": to_world @ local, "bsdf": self._bsdf()}
        return {"panel": shape | ({"emitter": emitter} if self.level else {})}

    def _bsdf(self) -> dict[str, Any]:
        if not self.through:
            return TWO_SIDED_BLACK
        pane = {"type": "thindielectric", "int_ior": 1.0, "ext_ior": 1.0}
        return pane | {"specular_transmittance": {"type": "rgb", "value": list(self.through)}}


@dataclass(frozen=True)
class Dome:
    """The inside of a ball, for scenes that are all inside it."""

    def lamp(self) -> Lamp:
        return lamps.ball()

    def stock(self, folder: Path, to_world: Any, dimmer: float) -> dict[str, Any]:
        surface = self.lamp().surface
        path = folder / "dome.ply"
        inward = surface.triangles[:, ::-1]
        trimesh.Trimesh(surface.positions, inward, process=False).export(path)
        radiance = {"type": "rgb", "value": list(COLOUR * dimmer)}
        shape = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": BLACK}
        emitter = {"type": "area", "radiance": radiance}
        return {"dome": shape | {"to_world": to_world, "emitter": emitter}}


@dataclass(frozen=True)
class Hanging:
    """A lamp at a place."""

    kind: Any
    to_world: Any
    dimmer: float = 1.0


def twins(
    folder: Path, room: dict[str, Any], hangings: Sequence[Hanging]
) -> tuple[mi.Scene, mi.Scene]:
    """The same room with the same lamps, PureLight's and Mitsuba's."""
    ours, stock = dict(room), dict(room)
    for index, hanging in enumerate(hangings):
        path = folder / f"lamp{index}.plux"
        hanging.kind.lamp().write(path)
        settings = {"to_world": hanging.to_world, "dimmer": hanging.dimmer}
        ours[f"lamp{index}"] = {"type": "purelight", "filename": str(path), **settings}
        shapes = hanging.kind.stock(folder, hanging.to_world, hanging.dimmer)
        stock |= {f"lamp{index}_{name}": shape for name, shape in shapes.items()}
    return mi.load_dict(ours), mi.load_dict(stock)


class Lobe(mi.Emitter):
    """An area emitter whose radiance falls with the fourth power of the cosine."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self._radiance = mi.Color3f(props["radiance"])
        self.m_flags = mi.EmitterFlags.Surface

    def _value(self, cosine: mi.Float, active: Any) -> mi.Color3f:
        value = self._radiance * dr.square(dr.square(cosine))
        return dr.select(active & (cosine > 0), value, 0)

    def eval(self, si: Any, active: Any = True) -> mi.Color3f:
        return self._value(mi.Frame3f.cos_theta(si.wi), active)

    def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, mi.Color3f]:
        ds = self.get_shape().sample_direction(it, sample, active)
        ds.emitter = mi.EmitterPtr(self)
        value = self._value(-dr.dot(ds.d, ds.n), active & (ds.pdf > 0))
        return ds, dr.select(ds.pdf > 0, value / ds.pdf, 0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        pdf = self.get_shape().pdf_direction(it, ds, active)
        return dr.select(dr.dot(ds.d, ds.n) < 0, pdf, 0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Color3f:
        return self._value(-dr.dot(ds.d, ds.n), active)

    def bbox(self) -> Any:
        return self.get_shape().bbox()

    def to_string(self) -> str:
        return "Lobe[]"


mi.register_emitter("lobe", Lobe)
