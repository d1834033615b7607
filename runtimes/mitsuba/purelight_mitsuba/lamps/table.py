"""All lamps of a scene: one mesh of their exit surfaces, and a table of where they hang."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.smooth_normals import corner_normals
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.finish_bsdf import FinishBSDF, ScatterBSDF
from purelight_mitsuba.lamps.finishes import Finishes, Look, sides
from purelight_mitsuba.lamps.lamp_choice import NONE, LampChoice
from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.sampling.surface_sampler import SurfaceSampler

COLUMNS = 5  # Packets of four floats per lamp.
OVERLAPPING = 64  # Bits of the mask in which a ray notes the overlapping lamps it has passed.


@dataclass
class Hit:
    """Where rays first meet an exit surface.

    Arguments:
        valid: Whether they do.
        t: Distance.
        lamp: Index of the lamp.
        facet: Index of the triangle among those of all lamps.
        normal: Geometric unit normal in the luminaire frame, either side.
        uv: Barycentric coordinates on the triangle.
    """

    valid: mi.Bool
    t: mi.Float
    lamp: mi.UInt32
    facet: mi.UInt32
    normal: mi.Normal3f
    uv: mi.Point2f = field(default_factory=lambda: mi.Point2f(0))


@dataclass
class Frame:
    """Placement of one lamp per lane: world = scale · rotation · local + translation.

    Arguments:
        x, y, z: Rows of the rotation.
    """

    x: mi.Vector3f
    y: mi.Vector3f
    z: mi.Vector3f
    translation: mi.Point3f
    scale: mi.Float
    dimmer: mi.Float

    def direction_to_local(self, d: mi.Vector3f) -> mi.Vector3f:
        return dr.fma(self.x, d.x, dr.fma(self.y, d.y, self.z * d.z))

    def direction_to_world(self, d: mi.Vector3f) -> mi.Vector3f:
        return mi.Vector3f(dr.dot(self.x, d), dr.dot(self.y, d), dr.dot(self.z, d))

    def point_to_local(self, p: mi.Point3f) -> mi.Point3f:
        return mi.Point3f(self.direction_to_local(mi.Vector3f(p - self.translation)) / self.scale)

    def point_to_world(self, p: mi.Point3f) -> mi.Point3f:
        turned = self.direction_to_world(mi.Vector3f(p))
        return mi.Point3f(dr.fma(turned, self.scale, self.translation))


@dataclass
class Place(Frame):
    """One lamp per lane.

    Arguments:
        bit: Of `passed` masks; zero for a lamp whose bounding sphere meets no other.
    """

    asset: mi.UInt32
    bit: mi.UInt64
    centre: mi.Point3f
    radius: mi.Float

    def radii(self, p: mi.Point3f) -> mi.Float:
        """How many radii a point is away from the centre."""
        return dr.norm(p - self.centre) / self.radius


class Lamps:
    """The lamps of a scene on the device.

    Their exit surfaces are one mesh in a scene of its own, so that a ray finds the nearest lamp by
    one query and a lookup, without a virtual call.

    Arguments:
        emitters: The lamps, at least one.
        room: The scene without them, which CUDA needs to share its ray-tracing pipeline.
        groups: Names of light groups to keep apart, the first one of Mitsuba's own emitters.

    Attributes:
        luminaires: The different bundles among them.
        surface: Draws points of their exit surfaces; counts them as `luminaires`.
        single: Whether there is only one lamp.
        overlapping: Whether the bounding spheres of any two meet.
        dark: Whether no lamp shines.
        finished: Whether any says of what it is made, so that paths may have vertices there.
        sheets: Whether any of that is thin-walled.
    """

    def __init__(
        self, emitters: Sequence[PureLightEmitter], room: mi.Scene, groups: Sequence[str] = ()
    ) -> None:
        self.groups = tuple(groups)
        if self.groups:
            self._groups = mi.UInt32([self.groups.index(e.light_group) for e in emitters])
        self.single = len(emitters) == 1
        self.luminaires: list[Luminaire] = list(dict.fromkeys(e.luminaire for e in emitters))
        self.finished = any(emitter.finishes for emitter in emitters)
        self.sheets = any(f.thin_walled and not f.opaque for e in emitters for f in e.finishes)
        mesh = self._finish(emitters) if self.finished else _mesh(emitters, None)
        self._scene = _scene(mesh, room)
        self.surface = SurfaceSampler([luminaire.surface for luminaire in self.luminaires])
        self._facets = device_array(mi.Float, _facets(emitters))
        counts = [len(e.luminaire.surface.triangles) for e in emitters]
        self._first = device_array(mi.UInt32, np.cumsum([0, *counts[:-1]]))
        places = _places(emitters, self.luminaires)
        self._places = device_array(mi.Float, places)
        self.overlapping = bool((places[:, 3, 3] >= 0).any())
        self.dark = not any(e.level * e.luminaire.power > 0 for e in emitters)
        self._choice = None if self.single or self.dark else LampChoice(emitters)

    def _finish(self, emitters: Sequence[PureLightEmitter]) -> mi.Mesh:
        """Notes of what lamps are made; returns the mesh that reflects, in which rays meet them."""
        finishes, indices = sides(emitters)
        self._finishes, self._sides = Finishes(finishes), device_array(mi.UInt32, indices)
        smooth = _normals(emitters)
        self._normals = None if smooth is None else device_array(mi.Float, smooth)
        mesh = _mesh(emitters, smooth, FinishBSDF(self._finishes, self._sides))
        scatter = ScatterBSDF(self._finishes, self._sides)
        self._scattering = _mesh(emitters, smooth, scatter, copies=2)
        self._shapes = mi.ShapePtr(mesh), mi.ShapePtr(self._scattering)
        self._count = mi.UInt32(len(indices))
        dr.make_opaque(self._count)
        return mesh

    def intersect(self, ray: mi.Ray3f, active: mi.Bool) -> Hit:
        """Finds the first exit surface along rays in the world."""
        found = self._scene.ray_intersect_preliminary(ray, active=active)
        valid = active & found.is_valid()
        facet = dr.gather(mi.Vector4f, self._facets, found.prim_index, valid)
        normal = mi.Normal3f(facet.x, facet.y, facet.z)
        lamp, uv = mi.UInt32(facet.w), found.prim_uv
        return Hit(valid, found.t, lamp, found.prim_index, normal, uv)

    def first(self, ray: mi.Ray3f, lamp: mi.UInt32, active: mi.Bool, *, other: bool = False) -> Hit:
        """Finds the first exit surface that is a lamp's own, or that is any other's.

        The same as `intersect` in scenes where no two lamps overlap, but for what it does not seek.
        """
        hit = self.intersect(ray, active)
        if not self.overlapping:
            hit.valid &= (hit.lamp == lamp) != other
            return hit

        def further(start: mi.Float, hit: Hit, going: mi.Bool) -> tuple[mi.Float, Hit, mi.Bool]:
            point = dr.fma(ray.d, start, ray.o)
            lift = (1 + start + dr.max(dr.abs(point))) * mi.math.RayEpsilon
            onward = mi.Ray3f(dr.fma(ray.d, start + lift, ray.o), ray.d)
            onward.maxt = ray.maxt - start - lift
            found = self.intersect(onward, going)
            found.t += start + lift
            return found.t, found, found.valid & ((found.lamp == lamp) == other)

        going = hit.valid & ((hit.lamp == lamp) == other)
        _, hit, _ = dr.while_loop(
            (mi.Float(hit.t), hit, going), lambda start, hit, going: going, further,
            label="a lamp among those that overlap",
        )  # fmt: skip
        return hit

    # Finishes, in scenes where there are any

    def look(self, hit: Hit, outgoing: mi.Vector3f) -> Look:
        """The finish of the side of a triangle that is hit.

        Arguments:
            outgoing: From there to the viewer, in the luminaire frame.
        """
        back = dr.dot(hit.normal, outgoing) < 0
        side = 2 * hit.facet + dr.select(back, mi.UInt32(1), mi.UInt32(0))
        return self._finishes.look(dr.gather(mi.UInt32, self._sides, side, hit.valid), hit.valid)

    def cosine(self, hit: Hit, place: Place, direction: mi.Vector3f) -> mi.Float:
        """Of the angle between a ray and the normal, interpolated where a finish is smooth.

        Arguments:
            direction: Of the ray, in the world.
        """
        if self._normals is None:
            return dr.abs(dr.dot(hit.normal, place.direction_to_local(direction)))
        corners = [
            dr.gather(mi.Vector3f, self._normals, 3 * hit.facet + k, hit.valid) for k in range(3)
        ]
        weights = (1 - hit.uv.x - hit.uv.y, hit.uv.x, hit.uv.y)
        mean = sum(n * w for n, w in zip(corners, weights, strict=True))
        return dr.abs(dr.dot(dr.normalize(mean), direction))

    def vertex(
        self,
        hit: Hit,
        distance: mi.Float,
        ahead: bool | mi.Bool = False,
        back: bool | mi.Bool = False,
    ) -> mi.PreliminaryIntersection3f:
        """Where a path ends at a lamp, as Mitsuba notes it.

        Arguments:
            distance: From the ray's origin.
            ahead, back: Whether it is scattered so, rather than reflected.
        """
        found = dr.zeros(mi.PreliminaryIntersection3f)
        found.valid, found.t = hit.valid, distance
        found.prim_index, found.prim_uv = hit.facet, hit.uv
        found.prim_index += dr.select(mi.Bool(back), self._count, 0)
        found.shape = dr.select(mi.Bool(ahead) | back, self._shapes[1], self._shapes[0])
        return found

    def owner(self, found: mi.PreliminaryIntersection3f) -> tuple[mi.UInt32, mi.UInt32]:
        """The lamp that a path's vertex is on, or NONE; and the same where it is scattered."""
        reflecting, scattering = (found.shape == shape for shape in self._shapes)
        on, index = found.is_valid() & (reflecting | scattering), found.prim_index
        index = dr.select(index >= self._count, index - self._count, index)
        lamp = mi.UInt32(dr.gather(mi.Vector4f, self._facets, index, on).w)
        return dr.select(on, lamp, NONE), dr.select(on & scattering, lamp, NONE)

    # Tables

    def group(self, lamp: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """Looks up the light groups of lamps."""
        return dr.gather(mi.UInt32, self._groups, lamp, active) if self.groups else mi.UInt32(0)

    def first_facet(self, lamp: mi.UInt32) -> mi.UInt32:
        """Looks up where the triangles of lamps begin among those of all."""
        return dr.gather(mi.UInt32, self._first, lamp)

    def place(self, lamp: mi.UInt32, active: mi.Bool) -> Place:
        """Looks up where lamps hang."""
        x, y, z, rest, sphere = (
            dr.gather(mi.Vector4f, self._places, lamp * COLUMNS + k, active) for k in range(COLUMNS)
        )
        bit = mi.UInt64(1) << mi.UInt64(dr.maximum(rest.w, 0))
        return Place(
            x=mi.Vector3f(x.x, x.y, x.z),
            y=mi.Vector3f(y.x, y.y, y.z),
            z=mi.Vector3f(z.x, z.y, z.z),
            translation=mi.Point3f(x.w, y.w, z.w),
            scale=rest.x,
            dimmer=rest.y,
            asset=mi.UInt32(rest.z),
            bit=dr.select(rest.w >= 0, bit, mi.UInt64(0)),
            centre=mi.Point3f(sphere.x, sphere.y, sphere.z),
            radius=sphere.w,
        )

    def pick(
        self, u: mi.Float, p: mi.Point3f, active: mi.Bool, own: int | mi.UInt32 = NONE
    ) -> tuple[mi.UInt32, mi.Float]:
        """Chooses a lamp for points in the world, by `LampChoice`: index and probability.

        Arguments:
            own: The lamp that a point is on, whose light it does not ask for, or NONE.
        """
        own = mi.UInt32(own)
        if self._choice is None:
            return mi.UInt32(0), dr.select(own == 0, mi.Float(0), 1)
        return self._choice.sample(u, p, active, own)

    def probability(
        self, lamp: mi.UInt32, p: mi.Point3f, active: mi.Bool, own: int | mi.UInt32 = NONE
    ) -> mi.Float:
        """The probability with which `pick` chooses a lamp for points in the world."""
        if self._choice is None:
            return mi.Float(1)
        (chance,) = dr.if_stmt(
            (lamp, p, mi.Bool(True), mi.UInt32(own)),
            active,
            lambda *arguments: (self._choice.probability(*arguments),),
            lambda *_: (mi.Float(1),),
        )
        return chance


def _normals(emitters: Sequence[PureLightEmitter]) -> np.ndarray | None:
    """Normals in the corners of all triangles in the world, [3 T, 3]; None if none is smooth."""
    if not any(finish.smooth for e in emitters for finish in e.finishes):
        return None
    kinds = {(e.luminaire, e.finishes) for e in emitters}
    own = {(lamp, f): corner_normals(lamp.surface, f).reshape(-1, 3) for lamp, f in kinds}
    return np.concatenate(
        [own[e.luminaire, e.finishes] @ e.placement.rotation.T for e in emitters], dtype=np.float32
    )


def _mesh(
    emitters: Sequence[PureLightEmitter], normals: np.ndarray | None,
    bsdf: mi.BSDF | None = None, copies: int = 1,
) -> mi.Mesh:  # fmt: skip
    """The exit surfaces in the world.

    Arguments:
        normals: Of their corners, [3 T, 3], if some are interpolated.
        copies: How often each triangle is there.
    """
    smooth = normals is not None
    positions = [e.placement.point_to_world(e.luminaire.surface.positions) for e in emitters]
    faces = [e.luminaire.surface.triangles.astype(np.uint32) for e in emitters]
    if smooth:
        positions = [p[f].reshape(-1, 3) for p, f in zip(positions, faces, strict=True)]
        faces = [np.arange(f.size, dtype=np.uint32).reshape(-1, 3) for f in faces]
    counts = np.cumsum([0, *map(len, positions)])
    props = mi.Properties()
    if bsdf is not None:
        props["bsdf"] = bsdf
    total = copies * sum(map(len, faces))
    mesh = mi.Mesh("exit surfaces", int(counts[-1]), total, props, has_vertex_normals=smooth)
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.concatenate(positions).astype(np.float32).ravel()
    own = [f + np.uint32(first) for f, first in zip(faces, counts, strict=False)]
    params["faces"] = np.tile(np.concatenate(own).ravel(), copies)
    if normals is not None:
        params["vertex_normals"] = normals.ravel()
    params.update()
    return mesh


def _scene(mesh: mi.Mesh, room: mi.Scene) -> mi.Scene:
    content = {"type": "scene", "lamps": mesh}
    if mi.variant().startswith("cuda"):
        content["room"] = room
    return mi.load_dict(content)


def _facets(emitters: Sequence[PureLightEmitter]) -> np.ndarray:
    """Normal in the luminaire frame and index of the lamp, for each triangle: [T, 4]."""
    own = {luminaire: luminaire.normals() for luminaire in {e.luminaire for e in emitters}}
    return np.concatenate([
        np.insert(own[emitter.luminaire], 3, index, axis=1)
        for index, emitter in enumerate(emitters)
    ], dtype=np.float32)  # fmt: skip


def _places(emitters: Sequence[PureLightEmitter], luminaires: list[Luminaire]) -> np.ndarray:
    """The table behind `Place`: [L, COLUMNS, 4]."""
    table = np.zeros((len(emitters), COLUMNS, 4))
    for row, emitter in zip(table, emitters, strict=True):
        placement, luminaire = emitter.placement, emitter.luminaire
        row[:3, :3], row[:3, 3] = placement.rotation, placement.translation
        row[3, :3] = placement.scale, emitter.level, luminaires.index(luminaire)
        row[4, :3] = placement.point_to_world(np.array([luminaire.sphere.center]))[0]
        row[4, 3] = placement.scale * luminaire.sphere.radius
    table[:, 3, 3] = _bits(table[:, 4, :3], table[:, 4, 3])
    return table


def _bits(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Numbers the lamps whose bounding spheres meet another's; -1 for the others."""
    overlapping = np.zeros(len(radii), bool)
    for lamp, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        meets = np.linalg.norm(centres - centre, axis=1) <= 1.001 * (radii + radius)
        overlapping[lamp] = meets.sum() > 1  # It meets itself
    if overlapping.sum() > OVERLAPPING:
        raise PureLightError(
            f"{overlapping.sum()} lamps have overlapping bounding spheres, but at most "
            f"{OVERLAPPING} may; move lamps apart or train groups of them as one lamp"
        )
    return np.where(overlapping, np.cumsum(overlapping) - 1, -1)
