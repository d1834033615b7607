"""Parts that are kept out of the networks: which may be, and what they look like."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.usd.appearance_text import KeptPart
from purelight_train.light.exit_surface import visible_part
from purelight_train.light.finish_fit import finish_of
from purelight_train.light.interfaces import relative_index
from purelight_train.light.light_tracing import Lamp, trace_paths
from purelight_train.light.luminaire import scene_triangles, shape_mesh, triangle_counts
from purelight_train.light.material_probe import PASSED, Material
from purelight_train.light.scattering import Scattered

PATHS = 1 << 18
MOST_LIGHT = 0.02  # of the lamp's: a part that gets more is not away from the light
LEAST_SEEN = 0.5  # of a part's area, from outside
LEAST_PASSED = 2e-3
SIGHTS = 1 << 18
Array = NDArray[np.float64]


def kept_parts(scene: Path) -> list[KeptPart]:
    """The parts of a `kept.xml`.

    Raises:
        PureLightError: Mitsuba does not take it.
    """
    try:
        loaded = mi.load_file(str(scene.resolve()), optimize=False)
    except RuntimeError as error:
        raise PureLightError(f"{scene}: {' '.join(str(error).split())[-300:]}") from None
    return [_part(shape) for shape in loaded.shapes()]


def _part(shape: mi.Shape) -> KeptPart:
    positions, triangles, normals = shape_mesh(shape)
    bsdf, uv = shape.bsdf(), np.random.default_rng(5).random((256, 2))
    finish = finish_of(
        Material(bsdf, uv, front=True), shape.id() or "part", relative_index(bsdf),
        smooth=normals is not None,
    )  # fmt: skip
    own = None if normals is None else normals.astype(np.float32)
    return KeptPart(
        finish.name, positions.astype(np.float32), triangles.astype(np.uint32), own, finish
    )


class _Arrivals:
    """Adds up the light that arrives at each shape; a visitor of `trace_paths`."""

    def __init__(self, lamp: Lamp) -> None:
        self._lamp, shapes = lamp, lamp.scene.shapes_dr()
        keys = np.array(dr.reinterpret_array(mi.UInt32, shapes))
        number = np.zeros(keys.max() + 1, np.uint32)
        number[keys] = np.arange(len(keys))
        self._number = mi.UInt32(number)
        self.power = dr.zeros(mi.Float, len(keys))
        dr.eval(self._number, self.power)

    def __call__(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, weight: mi.Color3f,
        sampler: mi.Sampler, active: mi.Bool,
    ) -> Scattered:  # fmt: skip
        key = dr.reinterpret_array(mi.UInt32, si.shape)
        number = dr.gather(mi.UInt32, self._number, key, active)
        dr.scatter_add(self.power, dr.sum(weight), number, active)
        return self._lamp.scatter(si, ray, weight, sampler, active)


def parts_away(path: Path) -> list[str]:
    """Names of the dark, opaque parts that are seen from outside and get next to no light."""
    scene: Any = mi.load_file(str(path.resolve()), optimize=False)
    lamp = Lamp(scene)
    visitor, sampler = _Arrivals(lamp), mi.load_dict({"type": "independent"})
    sampler.seed(0, PATHS)
    dr.eval(trace_paths(lamp, sampler, visitor))
    arrives = np.array(visitor.power, np.float64) / PATHS
    total = float(lamp.emission.power().sum())
    seen = _seen(scene)
    return [
        shape.id()
        for k, shape in enumerate(scene.shapes())
        if shape.id() and not shape.is_emitter() and seen[k] > LEAST_SEEN
        and arrives[k] <= MOST_LIGHT * total and _opaque(shape.bsdf())
    ]  # fmt: skip


def _seen(scene: mi.Scene) -> Array:
    """The part of each shape's area that is seen from outside."""
    positions, triangles, normals = scene_triangles(scene)
    surface = visible_part(positions, triangles, normals, SIGHTS, np.random.default_rng(0))
    assert surface.source is not None
    a, b, c = positions.astype(np.float64)[triangles.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    visible = np.zeros(len(triangles), bool)
    visible[surface.source] = True
    counts = triangle_counts(scene)
    shape = np.repeat(np.arange(len(counts)), counts)
    whole = np.bincount(shape, area, len(counts))
    result: Array = np.bincount(shape, area * visible, len(counts)) / np.maximum(whole, 1e-300)
    return result


def _opaque(bsdf: mi.BSDF) -> bool:
    uv = np.random.default_rng(5).random((256, 2))
    sides = (Material(bsdf, uv, front=front).ask() for front in (True, False))
    return all(float(side.part(*PASSED).max()) < LEAST_PASSED for side in sides)
