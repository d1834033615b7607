"""A lamp's scene as the checks look at it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_import.model.mesh import Mesh
from purelight_import.parts.hull import hull

Floats = NDArray[np.float64]


def lifted(
    point: mi.Point3f, normal: mi.Normal3f, direction: mi.Vector3f, extent: float
) -> mi.Ray3f:
    """A ray from a surface, lifted off in proportion to the lamp: Mitsuba's own lift is 0.1 mm."""
    size = dr.maximum(mi.Float(0.5 * extent), dr.max(dr.abs(point)))
    lift = dr.mulsign(mi.math.RayEpsilon * size, dr.dot(normal, direction))
    return mi.Ray3f(dr.fma(lift, normal, point), direction)


@dataclass(frozen=True)
class Subject:
    """A loaded scene, its shapes numbered."""

    scene: mi.Scene

    @cached_property
    def shapes(self) -> list[mi.Shape]:
        return list(self.scene.shapes())

    @cached_property
    def keys(self) -> NDArray[np.uint32]:
        """Registry index of each shape: [S]."""
        return np.array(dr.reinterpret_array(mi.UInt32, self.scene.shapes_dr()))

    @cached_property
    def emitter_shapes(self) -> mi.ShapePtr:
        """The shape of each emitter, null without: [E].

        Each is asked alone: `EmitterPtr.get_shape` asks every emitter of the process, and fails at
        one that outlived its shape.
        """
        return mi.ShapePtr([emitter.get_shape() for emitter in self.scene.emitters()])

    @cached_property
    def refracting(self) -> NDArray[np.bool_]:
        """Which shapes are surfaces of glass bodies: [S]."""
        wanted = (mi.BSDFFlags.Transmission, mi.BSDFFlags.NonSymmetric)
        return np.array([all(mi.has_flag(s.bsdf().flags(), f) for f in wanted)
                         for s in self.shapes], bool)  # fmt: skip

    @cached_property
    def emitting(self) -> NDArray[np.bool_]:
        """Which shapes are area emitters: [S]."""
        return np.array([s.is_emitter() for s in self.shapes], bool)

    @cached_property
    def bounds(self) -> Floats:
        """Least and largest coordinates: [2, 3]."""
        box = self.scene.bbox()
        return np.stack([np.array(p, np.float64).ravel() for p in (box.min, box.max)])

    @cached_property
    def extent(self) -> float:
        return float(np.ptp(self.bounds, axis=0).max())

    @cached_property
    def radius(self) -> float:
        """Of a sphere around the bounds, in metres."""
        return 0.5 * float(np.linalg.norm(np.ptp(self.bounds, axis=0)))

    def closed(self, shape: int) -> bool:
        """Whether a shape's surfaces have no edge."""
        parameters = mi.traverse(self.shapes[shape])
        if "vertex_positions" not in parameters:
            return bool(self.shapes[shape].shape_type() == +mi.ShapeType.Sphere)
        positions = np.array(parameters["vertex_positions"], np.float64).reshape(-1, 3)
        faces = np.array(parameters["faces"], np.uint32).reshape(-1, 3)
        return hull(Mesh(positions, faces)).all_closed

    def name(self, shape: int) -> str:
        return self.shapes[shape].id() or f"shape {shape}"

    def emitter_name(self, index: int) -> str:
        """What an emitter, or the shape that emits, is called."""
        emitter = self.scene.emitters()[index]
        shape = emitter.get_shape()
        return (shape.id() if shape is not None else emitter.id()) or f"emitter {index}"

    def numbers(self, pointers: mi.ShapePtr) -> NDArray[np.int64]:
        """Numbers of the shapes that rays met, -1 for none: [N]."""
        met = np.array(dr.reinterpret_array(mi.UInt32, pointers))
        order = np.argsort(self.keys)
        place = np.searchsorted(self.keys[order], met).clip(max=len(order) - 1)
        found = order[place]
        return np.where(self.keys[found] == met, found, -1)
