"""Triangles of a stage as meshes of Mitsuba's.

Copies are written out: an `instance` of Mitsuba's costs compile time that grows with the square of
their number (100 of them 10 s, 2,000 of them 455 s on a busy core), triangles cost memory alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.usd_scene.corners import Corners
from purelight_mitsuba.usd_scene.materials import Materials
from purelight_mitsuba.usd_scene.preview_surface import Look

MOST_TRIANGLES = 30_000_000  # Of a scene, a few gigabytes.


@dataclass
class Meshes:
    """Makes the meshes of a scene.

    Arguments:
        materials: Of the stage.
    """

    materials: Materials
    _triangles: int = 0

    def of(self, shape: Any, bound: Any, corners: Corners, places: np.ndarray) -> Iterator[mi.Mesh]:
        """The triangles at all places, with the material of a prim or subset.

        Arguments:
            shape: The prim that they are.
            bound: The prim or subset with the material's binding.
            places: [K, 4, 4] to the world, for column vectors.

        Raises:
            PureLightError: If the scene would have more triangles than fit into memory.
        """
        self._triangles += len(places) * len(corners.face)
        if self._triangles > MOST_TRIANGLES:
            raise PureLightError(
                f"{shape.GetPath()}: the stage has more than {MOST_TRIANGLES:,} triangles with "
                "all instances written out; hide some, or use simpler prototypes"
            )
        look = self.materials.look(bound, shape, flat=corners.uv is None)
        if look.mirrored is None:
            yield _lit(shape, look.bsdf, look, _written_out(corners, places))
            return
        reflected = np.linalg.det(places[:, :3, :3]) < 0
        for mirrored in (False, True):
            for turned in (False, True):
                own = corners.take(corners.mirrored() == (mirrored != turned))
                chosen = places[reflected == turned]
                if len(own.face) and len(chosen):
                    bsdf = look.mirrored if mirrored else look.bsdf
                    yield _lit(shape, bsdf, look, _written_out(own, chosen))


@dataclass(frozen=True)
class _Buffers:
    """Values at vertices [V, ...] and triangles [T, 3] of them."""

    position: np.ndarray
    normal: np.ndarray | None
    uv: np.ndarray | None
    triangles: np.ndarray


def _written_out(corners: Corners, places: np.ndarray) -> _Buffers:
    """The triangles at all places, in float64."""
    if len(places) == 1:
        own = corners.under(places[0])
        normal, uv = (
            None if a is None else a.reshape(-1, a.shape[-1]) for a in (own.normal, own.uv)
        )
        index = np.arange(3 * len(own.face)).reshape(-1, 3)
        return _Buffers(own.position.reshape(-1, 3), normal, uv, index)
    one = _welded(corners)
    turn, shift = places[:, :3, :3], places[:, None, :3, 3]
    position = one.position @ turn.swapaxes(1, 2) + shift
    normal = None if one.normal is None else _unit(one.normal @ np.linalg.pinv(turn))
    uv = None if one.uv is None else np.tile(one.uv, (len(places), 1))
    index = one.triangles + len(one.position) * np.arange(len(places))[:, None, None]
    reflected = np.linalg.det(turn) < 0
    index[reflected] = index[reflected][..., ::-1]
    return _Buffers(position.reshape(-1, 3), normal, uv, index.reshape(-1, 3))


def _welded(corners: Corners) -> _Buffers:
    """The triangles with vertices in common where all values are equal."""
    arrays = (corners.position, corners.normal, corners.uv)
    rows = np.concatenate([a.reshape(-1, a.shape[-1]) for a in arrays if a is not None], 1)
    rows, index = np.unique(rows.astype(np.float32), axis=0, return_inverse=True)
    position, rest = rows[:, :3], rows[:, 3:]
    normal = None if corners.normal is None else rest[:, :3].astype(np.float64)
    uv = None if corners.uv is None else rest[:, -2:]
    return _Buffers(position.astype(np.float64), normal, uv, index.reshape(-1, 3))


def _unit(normal: np.ndarray) -> np.ndarray:
    length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30)
    return (normal / length).reshape(-1, 3)


def _lit(shape: Any, bsdf: mi.BSDF, look: Look, buffers: _Buffers) -> mi.Mesh:
    """A mesh with the light that its material gives it.

    One that shines is drawn without its vertex normals, by which Mitsuba takes the density of the
    points that it aims at: it lost a third of the light of a smooth-shaded panel.
    """
    if look.radiance is None:
        return _mesh(shape, bsdf, None, buffers)
    buffers = replace(buffers, normal=None)
    emitter = look.emitter(lambda: _mesh(shape, bsdf, None, buffers))
    return _mesh(shape, bsdf, emitter, buffers)


def _mesh(shape: Any, bsdf: mi.BSDF, emitter: mi.Emitter | None, buffers: _Buffers) -> mi.Mesh:
    props = mi.Properties()
    props["bsdf"] = bsdf
    if emitter is not None:
        props["emitter"] = emitter
    if buffers.normal is None:
        props["face_normals"] = True
    result = mi.Mesh(
        str(shape.GetPath()), len(buffers.position), len(buffers.triangles), props,
        has_vertex_normals=buffers.normal is not None,
        has_vertex_texcoords=buffers.uv is not None,
    )  # fmt: skip
    parameters = mi.traverse(result)
    parameters["vertex_positions"] = device_array(mi.Float, buffers.position)
    parameters["faces"] = device_array(mi.UInt32, buffers.triangles)
    if buffers.normal is not None:
        parameters["vertex_normals"] = device_array(mi.Float, buffers.normal)
    if buffers.uv is not None:
        parameters["vertex_texcoords"] = device_array(mi.Float, buffers.uv)
    parameters.update()
    return result
