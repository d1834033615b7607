"""Parts that are kept out of the networks: which may be, and what they look like."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS
from purelight_format.measures import BoundingSphere
from purelight_format.members.finishes import Finish
from purelight_format.usd.appearance_text import KeptPart
from purelight_mitsuba.scene_file import load_scene
from purelight_train.light.exit_surface import ExitSurface, bounding_sphere
from purelight_train.light.finish_fit import finish_of
from purelight_train.light.interfaces import relative_index
from purelight_train.light.light_tracing import Lamp, trace_paths
from purelight_train.light.luminaire import shape_mesh
from purelight_train.light.material_probe import PASSED, Material
from purelight_train.light.scattering import Scattered

PATHS = 1 << 15
MOST_LIGHT = 0.04  # of the lamp's: a part that gets more is not away from the light
BEYOND = 1.1  # radii of the sphere around the rest
PLACES = 1 << 12
LEAST_PASSED = 2e-3
Array = NDArray[np.float64]


def kept_parts(scene: Path) -> list[KeptPart]:
    """The parts of a `kept.xml`, those of the same material as one.

    Raises:
        PureLightError: Mitsuba does not take it, or there are too many materials.
    """
    loaded = load_scene(scene, optimize=False)
    groups: dict[Finish, list[KeptPart]] = {}
    for part in map(_part, loaded.shapes()):
        groups.setdefault(replace(part.finish, name=""), []).append(part)
    if len(groups) > LIMITS.finishes:
        raise PureLightError(
            f"{scene}: {len(groups)} materials, at most {LIMITS.finishes} can be kept; keep fewer "
            "parts"
        )
    return [_joined(group) for group in groups.values()]


def _joined(parts: list[KeptPart]) -> KeptPart:
    """Parts of one material as one mesh, with the name of the first."""
    first = np.cumsum([0, *(len(part.positions) for part in parts)])
    normals = [part.normals for part in parts if part.normals is not None]
    return KeptPart(
        parts[0].name,
        np.concatenate([part.positions for part in parts]),
        np.concatenate([p.triangles + np.uint32(k) for p, k in zip(parts, first, strict=False)]),
        np.concatenate(normals) if normals else None,
        parts[0].finish,
    )


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


def parts_away(scene: mi.Scene) -> list[str]:
    """Names of the dark, opaque parts that are away from the light, and so from the rest.

    They get next to none of it, and lie for the greater part outside of the sphere around all that
    shines, lets light pass, or gets more of it.
    """
    shapes = scene.shapes()
    dark = np.array([not shape.is_emitter() and _opaque(shape.bsdf()) for shape in shapes])
    places = _places(scene)
    if not _beyond(places, dark).any():  # No more than these can be, so that no light is needed.
        return []
    dark &= _arriving(scene) <= MOST_LIGHT
    away = _beyond(places, dark)
    return [shape.id() for k, shape in enumerate(shapes) if away[k] and shape.id()]


def _beyond(places: list[NDArray[np.float32]], dark: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which dark shapes lie for the greater part outside of the sphere around the others: [S]."""
    if dark.all() or not dark.any():
        return np.zeros(len(dark), bool)
    rest = np.concatenate([p for p, d in zip(places, dark, strict=True) if not d])
    sphere = bounding_sphere(rest)
    return np.array([d and _outside(p, sphere) for p, d in zip(places, dark, strict=True)])


def _arriving(scene: mi.Scene) -> Array:
    """The part of the emitted light that arrives at each shape, each time it does: [S]."""
    lamp = Lamp(scene)
    visitor, sampler = _Arrivals(lamp), mi.load_dict({"type": "independent"})
    sampler.seed(0, PATHS)
    dr.eval(trace_paths(lamp, sampler, visitor))
    result: Array = np.array(visitor.power, np.float64) / PATHS / lamp.emission.power().sum()
    return result


def _places(scene: mi.Scene) -> list[NDArray[np.float32]]:
    """Points spread evenly over each shape: [PLACES, 3] each."""
    rng, result = np.random.default_rng(0), []
    for shape in scene.shapes():
        vertices, faces, _ = shape_mesh(shape)
        surface = ExitSurface(
            vertices.astype(np.float32), faces.astype(np.uint32), np.zeros(len(faces), bool)
        )
        result.append(surface.sample(PLACES, rng)[0])
    return result


def _outside(places: NDArray[np.float32], sphere: BoundingSphere) -> bool:
    distance = np.linalg.norm(places - np.array(sphere.center), axis=1) / sphere.radius
    return bool((distance > BEYOND).mean() > 0.5)


def _opaque(bsdf: mi.BSDF) -> bool:
    uv = np.random.default_rng(5).random((256, 2))
    sides = (Material(bsdf, uv, front=front).ask() for front in (True, False))
    return all(float(side.part(*PASSED).max()) < LEAST_PASSED for side in sides)
