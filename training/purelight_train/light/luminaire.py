"""A luminaire: a Mitsuba 3 scene that holds only a lamp, checked and ready for light tracing."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import trimesh
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.members.manifest import LARGEST, SMALLEST
from purelight_mitsuba.scene_file import load_scene
from purelight_train.light import vertex_normals
from purelight_train.light.emission import Emission
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface, inward_rays
from purelight_train.light.interfaces import Interfaces
from purelight_train.light.light_tracing import BATCH, trace_records
from purelight_train.light.plugins import ray_file_plugin
from purelight_train.light.rays import scene_extent
from purelight_train.light.scene_files import scene_digest
from purelight_train.light.virtual_surface import hull
from purelight_train.light.visible_part import visible_part

VISIBILITY_RAYS = 1 << 21
LEAST_SEEN = 50  # rays, to judge a shape by
FLAT_COSINE = 0.9999  # between a corner's normal and its facet's, where a mesh is flat
RAY_HULL_SIDES = 96
# Radii from the origin. There light is 0.4 % wrong for want of digits, 3 % at a thousand, and at
# ten thousand rays jump over walls
FARTHEST = 100
MOSTLY = 0.5  # of an emitter's rays; a few that are not finite are dropped and told
SECTIONS = 128  # of analytic disks and cylinders


@dataclass(frozen=True)
class Luminaire:
    """A lamp's scene, its exit surface, and the digest of its files.

    Arguments:
        index: refractive index of most of the exit surface that refracts; 1 without any.
    """

    path: Path
    scene: mi.Scene
    exit_surface: ExitSurface
    digest: str
    index: float = 1.0
    opaque: bool = False  # Whether nothing can be seen through it, whatever it is made of.

    @cached_property
    def emission(self) -> Emission:
        """Its emitters."""
        return Emission.of(self.scene, dr.opaque(mi.Float, scene_extent(self.scene)))

    def trace(
        self, paths: int, seed: int, progress: Callable[[int], None] = lambda _: None
    ) -> ExitRecords:
        """Light of at least so many paths, and of paths' crossings; see `trace_records`."""
        return trace_records(self.scene, paths, seed, progress, self.exit_surface)

    def held_out(self, seed: int) -> ExitRecords:
        """Light that no network is trained on."""
        return self.trace(BATCH, seed)


def load_luminaire(path: str | Path, seed: int = 0) -> Luminaire:
    """Load a Mitsuba scene file that holds only a lamp.

    Raises:
        PureLightError: the file is missing or not a scene, holds no emitter, or holds an emitter
            at infinity.
    """
    path = Path(path)
    scene = _load_scene(path)
    _check_emitters(path, scene)
    rng = np.random.default_rng([seed, 1])
    surface = _exit_surface(scene, rng)
    _check_size(path, surface)
    luminaire = Luminaire(path, scene, surface, scene_digest(path), exit_index(scene, surface))
    _check_radiance(luminaire)
    _check_glass(scene, surface)
    return luminaire


def _exit_surface(scene: mi.Scene, rng: np.random.Generator) -> ExitSurface:
    """What is seen of the lamp's shapes, and of hulls around the rays of its ray files."""
    positions, triangles, normals = scene_triangles(scene)
    plugin = ray_file_plugin()
    hulls = [
        hull(emitter.rays.position.astype(np.float64), RAY_HULL_SIDES)
        for emitter in scene.emitters() if isinstance(emitter, plugin)
    ]  # fmt: skip
    for vertices, faces in hulls:
        triangles = np.concatenate([triangles, faces + np.uint32(len(positions))])
        positions = np.concatenate([positions, vertices])
        normals = np.concatenate([normals, np.zeros_like(vertices)])
    surface = visible_part(positions, triangles, normals, VISIBILITY_RAYS, rng)
    if not hulls:
        return surface
    known = _among(surface.positions, np.concatenate([vertices for vertices, _ in hulls]))
    return replace(surface, virtual=np.asarray(known[surface.triangles].all(axis=1), bool))


def _among(points: NDArray[np.float32], others: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which points [N, 3] are exactly one of others: [N]."""
    whole, place = np.unique(np.concatenate([others, points]), axis=0, return_inverse=True)
    known = np.zeros(len(whole), bool)
    known[place.ravel()[: len(others)]] = True
    found: NDArray[np.bool_] = known[place.ravel()[len(others) :]]
    return found


def exit_index(scene: mi.Scene, surface: ExitSurface) -> float:
    """The refractive index that rays from outside meet most often, of those that refract."""
    origin, direction = inward_rays(surface.sphere, 1 << 14, np.random.default_rng(0), cosine=True)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction.T)))
    interfaces = Interfaces(scene)
    met = np.array(interfaces.relative(si.bsdf(), si, si.is_valid()))[np.array(si.is_valid())]
    index, count = np.unique(met[met > 1 + 1e-3], return_counts=True)
    return float(index[np.argmax(count)]) if len(index) else 1.0


def _load_scene(path: Path) -> mi.Scene:
    if not path.is_file():
        raise PureLightError(f"{path}: no such file; give a Mitsuba 3 scene (.xml) of a lamp")
    ray_file_plugin()
    # Mitsuba would join meshes of one material, forget their names, and fail where some are flipped
    scene = load_scene(path, optimize=False)
    if not isinstance(scene, mi.Scene):
        raise PureLightError(f"{path}: the file holds no <scene>; wrap the lamp's shapes in one")
    vertex_normals.settle(scene)
    return scene


def _check_emitters(path: Path, scene: mi.Scene) -> None:
    if not scene.emitters():
        raise PureLightError(f"{path}: the scene has no emitter; add one to the lamp's filament")
    infinite = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection
    for index, emitter in enumerate(scene.emitters()):
        if emitter.is_environment() or mi.has_flag(emitter.flags(), infinite):
            area = emitter.get_shape() is not None  # `directionalarea`
            where = "in one direction alone" if area else "from infinity"
            raise PureLightError(
                f"{path}: {_named(emitter, index)} shines {where}; a lamp needs area, point or "
                "spot emitters"
            )
    for shape in scene.shapes():
        if shape.is_emitter() and shape.is_mesh() and shape_mesh(shape)[2] is not None:
            warnings.warn(
                f"emitter mesh '{shape.id()}' has smooth normals, which biases its emission; "
                "set face_normals to true",
                stacklevel=3,
            )


def _check_size(path: Path, surface: ExitSurface) -> None:
    """Refuse what a bundle cannot say, and what 32-bit numbers cannot tell apart."""
    radius = surface.sphere.radius
    if not SMALLEST <= radius <= LARGEST:
        raise PureLightError(f"{path}: the lamp is {2 * radius:.3g} m across; model it in metres")
    away = max(map(abs, surface.sphere.center))
    if not away <= FARTHEST * radius:
        raise PureLightError(
            f"{path}: the lamp is {away:.3g} m from the origin, too far for its size of "
            f"{2 * radius:.3g} m; move it to the origin"
        )


def _named(emitter: mi.Emitter, index: int) -> str:
    """An emitter by its own name or its shape's, else by its number."""
    shape = emitter.get_shape()
    name = emitter.id() or (shape.id() if shape is not None else "")
    return f"emitter '{name}'" if name else f"emitter {index} (it has no id)"


def _check_radiance(luminaire: Luminaire) -> None:
    """Refuse emitters that take light away, or whose radiance has no R, G and B or no end."""
    path, emitters = luminaire.path, luminaire.scene.emitters()
    try:
        power = luminaire.emission.power()
    except RuntimeError as error:
        reason = " ".join(str(error).split())[-200:]
        raise PureLightError(
            f"{path}: an emitter has no radiance in R, G and B; give it as <rgb> ({reason})"
        ) from None
    if negative := np.flatnonzero((power < 0).any(1)).tolist():
        named = _named(emitters[negative[0]], negative[0])
        raise PureLightError(f"{path}: {named} has negative radiance; give zero or more")
    if broken := np.flatnonzero(luminaire.emission.broken() > MOSTLY).tolist():
        named = _named(emitters[broken[0]], broken[0])
        raise PureLightError(
            f"{path}: the radiance or the place of {named} is not finite; give numbers"
        )


def _check_glass(scene: mi.Scene, surface: ExitSurface) -> None:
    """Warn of glass that shows its back to the outside, where it should begin."""
    shapes = scene.shapes_dr()
    glass = [
        mi.has_flag(s.bsdf().flags(), mi.BSDFFlags.Transmission)
        and mi.has_flag(s.bsdf().flags(), mi.BSDFFlags.NonSymmetric)
        for s in shapes
    ]
    if not any(glass):
        return
    origin, direction = inward_rays(surface.sphere, 1 << 14, np.random.default_rng(0), cosine=True)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction.T)))
    index = np.array(dr.reinterpret_array(mi.UInt32, si.shape))
    outward = np.array(mi.Frame3f.cos_theta(si.wi)) > 0
    for shape, key, is_glass in zip(
        shapes, np.array(dr.reinterpret_array(mi.UInt32, shapes)), glass, strict=True
    ):
        seen = outward[index == key]
        if is_glass and len(seen) > LEAST_SEEN and seen.mean() < 0.1:
            warnings.warn(
                f"glass '{shape.id()}' is inside out as seen from outside; turn its faces "
                "(flip_normals), or its light is refracted wrongly",
                stacklevel=3,
            )


def scene_triangles(
    scene: mi.Scene,
) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.float32]]:
    """All shapes of the scene as one triangle soup.

    Returns:
        vertices [V, 3], triangles [T, 3], and unit normals [V, 3] of the vertices of smooth shapes,
        zero at those of flat ones.
    """
    positions, triangles, normals = ([np.zeros((0, 3))] for _ in range(3))
    count = 0
    for shape in scene.shapes():
        vertices, faces, smooth = shape_mesh(shape)
        positions.append(vertices)
        triangles.append(faces + count)
        normals.append(np.zeros_like(vertices) if smooth is None else smooth)
        count += len(vertices)
    return (
        np.concatenate(positions).astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
        np.concatenate(normals).astype(np.float32),
    )


def triangle_counts(scene: mi.Scene) -> list[int]:
    """How many of the triangles of `scene_triangles` each shape has."""
    return [len(shape_mesh(shape)[1]) for shape in scene.shapes()]


Part = tuple[NDArray[Any], NDArray[Any], NDArray[Any] | None]


def _bent_normals(
    shape: mi.Mesh, vertices: NDArray[Any], faces: NDArray[Any]
) -> NDArray[Any] | None:
    """Normals of a mesh's vertices [V, 3]; None where none bends over facets, as a cube's."""
    if not shape.has_vertex_normals() or shape.has_face_normals():
        return None
    normals = np.array(mi.traverse(shape)["vertex_normals"], np.float64).reshape(-1, 3)
    a, b, c = vertices.astype(np.float64)[faces.T]
    cross = np.cross(b - a, c - a)
    along = np.abs(np.einsum("tkd,td->tk", normals[faces], cross))
    bent = along < FLAT_COSINE * np.linalg.norm(cross, axis=1)[:, None]
    return normals if bent.any() else None


def shape_mesh(shape: mi.Shape) -> Part:
    """Vertices, faces and normals of the vertices, None where they are flat.

    Raises:
        PureLightError: it is no mesh and none of `PRIMITIVES`.
    """
    parameters, kind = mi.traverse(shape), shape.class_name()
    if "vertex_positions" in parameters:  # rectangles call themselves meshes, without any
        vertices = np.array(parameters["vertex_positions"]).reshape(-1, 3)
        faces = np.array(parameters["faces"]).reshape(-1, 3)
        return vertices, faces, _bent_normals(shape, vertices, faces)
    if kind not in PRIMITIVES or "to_world" not in parameters:
        said = "purelight-import makes a mesh of it" if kind == "Instance" else "make it a mesh"
        named = f"shape '{shape.id()}'" if shape.id() else "a shape without id"
        raise PureLightError(f"{named} ({kind.lower()}) is not supported; {said}")
    mesh, normals = PRIMITIVES[kind]()
    matrix = np.array(parameters["to_world"].matrix, dtype=np.float64).reshape(4, 4)
    if normals is not None:
        normals = normals @ _adjugate(matrix[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    mesh.apply_transform(matrix)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces), normals


def _adjugate(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse of a matrix [3, 3] up to a positive factor; finite for shapes without volume."""
    a, b, c = matrix
    sign = np.copysign(1.0, np.linalg.det(matrix))
    return sign * np.stack((np.cross(b, c), np.cross(c, a), np.cross(a, b)), axis=1)


def _sphere() -> tuple[trimesh.Trimesh, NDArray[Any] | None]:
    mesh = trimesh.creation.icosphere(subdivisions=5)
    return mesh, np.array(mesh.vertices)


def _rectangle() -> tuple[trimesh.Trimesh, NDArray[Any] | None]:
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False), None


def _disk() -> tuple[trimesh.Trimesh, NDArray[Any] | None]:
    ring = _ring(0.0)
    vertices = np.concatenate([[[0.0, 0.0, 0.0]], ring])
    i = np.arange(SECTIONS)
    faces = np.stack((np.zeros_like(i), 1 + i, 1 + (i + 1) % SECTIONS), 1)
    return trimesh.Trimesh(vertices, faces, process=False), None


def _open_cylinder() -> tuple[trimesh.Trimesh, NDArray[Any] | None]:
    """Mitsuba's cylinder: radius 1 around z from 0 to 1, without end caps."""
    vertices = np.concatenate([_ring(0.0), _ring(1.0)])
    i = np.arange(SECTIONS)
    j = (i + 1) % SECTIONS
    faces = np.concatenate(
        (np.stack((i, j, i + SECTIONS), 1), np.stack((j, j + SECTIONS, i + SECTIONS), 1))
    )
    return trimesh.Trimesh(vertices, faces, process=False), vertices * [1, 1, 0]


def _ring(z: float) -> NDArray[np.float64]:
    angle = np.linspace(0, 2 * np.pi, SECTIONS, endpoint=False)
    return np.stack((np.cos(angle), np.sin(angle), np.full(SECTIONS, z)), 1)


PRIMITIVES = {
    "Sphere": _sphere, "Rectangle": _rectangle, "Disk": _disk, "Cylinder": _open_cylinder
}  # fmt: skip
