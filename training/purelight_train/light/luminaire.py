"""A luminaire: a Mitsuba 3 scene that holds only a lamp, checked and ready for light tracing."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import trimesh
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_train.light.exit_surface import ExitSurface, inward_rays, visible_part

VISIBILITY_RAYS = 1 << 21
LEAST_SEEN = 50  # rays, to judge a shape by


@dataclass(frozen=True)
class Luminaire:
    """A lamp's scene, its exit surface, and the digest of its files."""

    path: Path
    scene: Any
    exit_surface: ExitSurface
    digest: str


def load_luminaire(path: str | Path, seed: int = 0) -> Luminaire:
    """Load a Mitsuba scene file that holds only a lamp.

    Raises:
        PureLightError: the file is missing or not a scene, holds no emitter, or holds an emitter
            at infinity.
    """
    path = Path(path)
    scene = _load_scene(path)
    _check_emitters(path, scene)
    positions, triangles = scene_triangles(scene)
    rng = np.random.default_rng([seed, 1])
    surface = visible_part(positions, triangles, VISIBILITY_RAYS, rng)
    _check_glass(scene, surface)
    return Luminaire(path, scene, surface, scene_digest(path))


def scene_digest(path: Path) -> str:
    """SHA-256 over the scene file and every mesh and texture beside it, in name order."""
    digest = hashlib.sha256(path.read_bytes())
    text = path.read_text(errors="replace")
    for file in sorted(p for p in path.parent.rglob("*") if p.is_file() and p != path):
        if file.name in text:
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _load_scene(path: Path) -> Any:
    if not path.is_file():
        raise PureLightError(f"{path}: no such file; give a Mitsuba 3 scene (.xml) of a lamp")
    try:
        scene = mi.load_file(str(path.resolve()))
    except Exception as error:
        reason = " ".join(str(error).split())
        raise PureLightError(f"{path}: not a Mitsuba 3 scene: {reason[-300:]}") from None
    if not isinstance(scene, mi.Scene):
        raise PureLightError(f"{path}: the file holds no <scene>; wrap the lamp's shapes in one")
    return scene


def _check_emitters(path: Path, scene: Any) -> None:
    if not scene.emitters():
        raise PureLightError(f"{path}: the scene has no emitter; add one to the lamp's filament")
    infinite = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection
    for emitter in scene.emitters():
        if emitter.is_environment() or mi.has_flag(emitter.flags(), infinite):
            raise PureLightError(
                f"{path}: emitter '{emitter.id()}' shines from infinity; a lamp needs area, "
                "point or spot emitters"
            )
    for shape in scene.shapes():
        if shape.is_emitter() and isinstance(shape, mi.Mesh) and shape.has_vertex_normals():
            warnings.warn(
                f"emitter mesh '{shape.id()}' has smooth normals, which biases its emission; "
                "set face_normals to true",
                stacklevel=3,
            )


def _check_glass(scene: Any, surface: ExitSurface) -> None:
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


def scene_triangles(scene: Any) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """All shapes of the scene as one triangle soup."""
    positions, triangles, count = [], [], 0
    for shape in scene.shapes():
        vertices, faces = _mesh(shape)
        positions.append(vertices)
        triangles.append(faces + count)
        count += len(vertices)
    return (
        np.concatenate(positions).astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
    )


def _mesh(shape: Any) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    parameters = mi.traverse(shape)
    if shape.is_mesh():
        vertices = np.array(parameters["vertex_positions"]).reshape(-1, 3)
        return vertices, np.array(parameters["faces"]).reshape(-1, 3)
    primitives = {
        mi.ShapeType.Sphere: lambda: trimesh.creation.icosphere(subdivisions=5),
        mi.ShapeType.Rectangle: lambda: trimesh.Trimesh(
            [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
        ),
        mi.ShapeType.Disk: lambda: trimesh.creation.annulus(1e-6, 1, 1e-9, sections=128),
        mi.ShapeType.Cylinder: _open_cylinder,
    }
    kind = mi.ShapeType(shape.shape_type())
    if kind not in primitives or "to_world" not in parameters:
        raise PureLightError(
            f"shape '{shape.id()}' ({kind.name.lower()}) is not supported; turn it into a mesh"
        )
    mesh = primitives[kind]()
    matrix = np.array(parameters["to_world"].matrix, dtype=np.float64).reshape(4, 4)
    mesh.apply_transform(matrix)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _open_cylinder() -> trimesh.Trimesh:
    """Mitsuba's cylinder: radius 1 around z from 0 to 1, without end caps."""
    angle = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    ring = np.stack((np.cos(angle), np.sin(angle)), 1)
    vertices = np.concatenate([np.c_[ring, np.full(128, z)] for z in (0.0, 1.0)])
    i = np.arange(128)
    j = (i + 1) % 128
    faces = np.concatenate((np.stack((i, j, i + 128), 1), np.stack((j, j + 128, i + 128), 1)))
    return trimesh.Trimesh(vertices, faces, process=False)
