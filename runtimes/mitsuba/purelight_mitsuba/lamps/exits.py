"""Exit surfaces of the lamps of a scene: where rays meet them, and what they are made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.bodies import Bodies, Kind
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.finished_bodies import FinishedBodies
from purelight_mitsuba.lamps.finishes import Finishes, Look
from purelight_mitsuba.lamps.frame import Frame
from purelight_mitsuba.lamps.instances import REACH, Instances
from purelight_mitsuba.lamps.lamp_choice import NONE
from purelight_mitsuba.lamps.spheres import meeting, spheres


@dataclass
class Hit:
    """Where rays first meet an exit surface.

    Arguments:
        valid: Whether they do.
        t: Distance.
        lamp: Index of the lamp.
        facet: Index of the triangle among those of all bodies.
        normal: Geometric unit normal in the luminaire frame, either side.
        uv: Barycentric coordinates on the triangle.
    """

    valid: mi.Bool
    t: mi.Float
    lamp: mi.UInt32
    facet: mi.UInt32
    normal: mi.Normal3f
    uv: mi.Point2f = field(default_factory=lambda: mi.Point2f(0))


class ExitSurfaces:
    """The exit surfaces in scenes of their own, so that rays meet them without a virtual call.

    They are one mesh in the world. On a processor, of a kind that hangs several times there is one
    body only (`Instances`), if its lamps are apart from all others.

    Arguments:
        emitters: The lamps, at least one.
        room: The scene without them, which CUDA needs to share its ray-tracing pipeline.

    Attributes:
        hanging: Bodies in the world.
        instances: Those that share bodies, if there are any.
    """

    def __init__(self, emitters: Sequence[PureLightEmitter], room: mi.Scene) -> None:
        shared = _shared(emitters)
        pairs = list(zip(emitters, shared, strict=True))
        hanging, common = ([e for e, s in pairs if s == kept] for kept in (False, True))
        self.hanging = Bodies([Kind.of(e) for e in hanging], [e.placement for e in hanging])
        bodies, first = [self.hanging], np.zeros(len(emitters), np.uint32)
        first[~shared] = self.hanging.first
        self.instances = Instances(common, np.flatnonzero(shared)) if common else None
        if self.instances is not None:
            bodies.append(self.instances.bodies)
            first[shared] = self.hanging.count + self.instances.first
        self._first = device_array(mi.UInt32, first)
        self._begin = dr.opaque(mi.UInt32, self.hanging.count)
        self._facets = device_array(mi.Float, _facets(bodies, np.flatnonzero(~shared)))
        self._finished: list[FinishedBodies] = []
        if any(emitter.finishes for emitter in emitters):
            self._finish(emitters, bodies)
        meshes = [each.mesh for each in self._finished] or [b.mesh() for b in bodies if b.count]
        if self.instances is not None:
            self.instances.load(meshes.pop())
        self._scene = _scene(meshes[0], room) if meshes else None

    def _finish(self, emitters: Sequence[PureLightEmitter], bodies: Sequence[Bodies]) -> None:
        """Notes of what lamps are made."""
        finishes = list(dict.fromkeys(f for emitter in emitters for f in emitter.finishes))
        self._finishes, sides = Finishes(finishes), [b.sides(finishes) for b in bodies]
        self._sides = device_array(mi.UInt32, np.concatenate(sides))
        self._normals = None
        if any(b.smooth for b in bodies):
            corners = np.concatenate([b.corner_normals() for b in bodies])
            self._normals = device_array(mi.Float, corners)
        pairs = zip(bodies, sides, strict=True)
        self._finished = [FinishedBodies(b, self._finishes, s) for b, s in pairs if b.count]

    def intersect(self, ray: mi.Ray3f, active: mi.Bool) -> Hit:
        """Finds the first exit surface along rays in the world."""
        if self._scene is None:
            return self._on_instance(ray, active)
        found = self._scene.ray_intersect_preliminary(ray, active=active)
        valid = active & found.is_valid()
        facet = dr.gather(mi.Vector4f, self._facets, found.prim_index, valid)
        lamp, normal = mi.UInt32(facet.w), mi.Normal3f(facet.x, facet.y, facet.z)
        hit = Hit(valid, found.t, lamp, found.prim_index, normal, found.prim_uv)
        if self.instances is None:
            return hit
        nearer = mi.Ray3f(ray)
        nearer.maxt = dr.select(valid, found.t, ray.maxt)
        other = self._on_instance(nearer, active)
        return dr.select(other.valid, other, hit)

    def _on_instance(self, ray: mi.Ray3f, active: mi.Bool) -> Hit:
        assert self.instances is not None
        found = self.instances.intersect(ray, active)
        valid, index = active & found.is_valid(), found.prim_index + self._begin
        facet = dr.gather(mi.Vector4f, self._facets, index, valid)
        normal = mi.Normal3f(facet.x, facet.y, facet.z)
        return Hit(valid, found.t, found.shape_index, index, normal, found.prim_uv)

    def first_facet(self, lamp: mi.UInt32) -> mi.UInt32:
        """Looks up where the triangles of lamps begin among those of all bodies."""
        return dr.gather(mi.UInt32, self._first, lamp)

    # Finishes, in scenes where there are any

    def look(self, hit: Hit, outgoing: mi.Vector3f) -> Look:
        """The finish of the side of a triangle that is hit.

        Arguments:
            outgoing: From there to the viewer, in the luminaire frame.
        """
        back = dr.dot(hit.normal, outgoing) < 0
        side = 2 * hit.facet + dr.select(back, mi.UInt32(1), mi.UInt32(0))
        return self._finishes.look(dr.gather(mi.UInt32, self._sides, side, hit.valid), hit.valid)

    def cosine(self, hit: Hit, place: Frame, direction: mi.Vector3f) -> mi.Float:
        """Of the angle between a ray and the normal, interpolated where a finish is smooth.

        Arguments:
            place: Of the lamp.
            direction: Of the ray, in the world.
        """
        local = place.direction_to_local(direction)
        if self._normals is None:
            return dr.abs(dr.dot(hit.normal, local))
        corners = [
            dr.gather(mi.Vector3f, self._normals, 3 * hit.facet + k, hit.valid) for k in range(3)
        ]
        weights = (1 - hit.uv.x - hit.uv.y, hit.uv.x, hit.uv.y)
        mean = sum(n * w for n, w in zip(corners, weights, strict=True))
        return dr.abs(dr.dot(dr.normalize(mean), local))

    def vertex(
        self,
        hit: Hit,
        distance: mi.Float,
        ahead: bool | mi.Bool = False,
        back: bool | mi.Bool = False,
    ) -> mi.PreliminaryIntersection3f:
        """Where a path ends at a lamp, as Mitsuba notes it; `shape_index` is the lamp's.

        Arguments:
            distance: From the ray's origin.
            ahead, back: Whether it is scattered so, rather than reflected.
        """
        found = dr.zeros(mi.PreliminaryIntersection3f)
        found.valid, found.t = hit.valid, distance
        found.prim_uv, found.shape_index = hit.uv, hit.lamp
        ahead, back = mi.Bool(ahead), mi.Bool(back)
        self._finished[0].note(found, hit.facet, ahead, back, mi.Bool(True))
        if self._scene is not None and self.instances is not None:
            instance = hit.facet >= self._begin
            self._finished[1].note(found, hit.facet - self._begin, ahead, back, instance)
        return found

    def owner(self, found: mi.PreliminaryIntersection3f) -> tuple[mi.UInt32, mi.UInt32]:
        """The lamp that a path's vertex is on, or NONE; and the same where it is scattered."""
        on, scattered = mi.Bool(False), mi.Bool(False)
        for each in self._finished:
            here, so = each.has(found)
            on, scattered = on | here, scattered | so
        lamp = found.shape_index
        return dr.select(on, lamp, NONE), dr.select(scattered, lamp, NONE)

    def in_world(
        self, si: mi.SurfaceInteraction3f, found: mi.PreliminaryIntersection3f, ray: mi.Ray3f
    ) -> mi.SurfaceInteraction3f:
        """A path's vertex as it is in the world, also on instances."""
        if self.instances is None or not self._finished:
            return si
        on, _ = self._finished[-1].has(found)  # The bodies of instances are the last
        return self.instances.to_world(si, found.shape_index, ray.d, on)


def _shared(emitters: Sequence[PureLightEmitter]) -> np.ndarray:
    """Which lamps share the body of their kind: [L]."""
    if mi.variant().startswith("cuda"):
        return np.zeros(len(emitters), bool)
    alone = ~meeting(*spheres(emitters), REACH)
    kinds = list(map(Kind.of, emitters))
    often = Counter(kind for kind, free in zip(kinds, alone, strict=True) if free)
    return alone & np.array([often[kind] > 1 for kind in kinds])


def _facets(bodies: Sequence[Bodies], lamps: np.ndarray) -> np.ndarray:
    """Normal in the luminaire frame, and the lamp that a body of the first ones is: [T, 4]."""
    normals = np.concatenate([b.normals() for b in bodies])
    lamp = np.zeros(len(normals), np.float32)
    lamp[: bodies[0].count] = np.repeat(lamps, bodies[0].counts)
    return np.column_stack([normals, lamp])


def _scene(mesh: mi.Mesh, room: mi.Scene) -> mi.Scene:
    content = {"type": "scene", "lamps": mesh}
    if mi.variant().startswith("cuda"):
        content["room"] = room
    return mi.load_dict(content)
