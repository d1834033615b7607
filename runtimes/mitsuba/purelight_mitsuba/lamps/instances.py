"""Lamps of few kinds: a body for each kind, a hull for each lamp."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.measures import Placement
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.bodies import Bodies, Kind
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.frame import Frame

REACH = 1.27  # Radii, within which a hull is; corners of an icosahedron are at 1.2584.
SHELL = 1.01  # Radii, within which a body is, whatever the rounding.
SPACING = 4.0  # Between the centres of bodies, whose radii are one.
PACKETS = 4  # Of four floats per lamp.
STEP = 1e-6  # Relative; a ray goes on by no less.


class Instances:
    """Two levels: hulls of lamps in the world, and in a space of its own a body of each kind.

    A hull is an icosahedron around a lamp's bounding sphere. Mitsuba's own instances are shapes,
    each of which Dr.Jit traces in each virtual call on shapes; here all hulls are one mesh, and all
    bodies.

    Arguments:
        emitters: The lamps, whose spheres do not meet if all are `REACH` times as large.
        numbers: Of the lamps in the scene.

    Attributes:
        bodies: One for each kind.
        first: Where the triangles of each lamp's body begin.
    """

    def __init__(self, emitters: Sequence[PureLightEmitter], numbers: np.ndarray) -> None:
        own = list(map(Kind.of, emitters))
        kinds = list(dict.fromkeys(own))
        number, offsets = [kinds.index(kind) for kind in own], _offsets(len(kinds))
        self.bodies = Bodies(kinds, [_alone(*pair) for pair in zip(kinds, offsets, strict=True)])
        self.first = self.bodies.first[number]
        rows = np.stack([_row(*pair) for pair in zip(emitters, offsets[number], strict=True)])
        table = np.zeros((max(numbers) + 1, PACKETS, 4))
        table[numbers] = rows
        self._table = device_array(mi.Float, table)
        self._numbers = device_array(mi.UInt32, numbers)
        centres, radii = rows[:, :3, 3], rows[:, 3, 3]
        self._hulls = mi.load_dict({"type": "scene", "hulls": _hulls(centres, radii)})
        self._largest = dr.opaque(mi.Float, float(2 * REACH * radii.max()))

    def load(self, mesh: mi.Mesh) -> None:
        """Lets rays meet a mesh of the bodies."""
        self._scene = mi.load_dict({"type": "scene", "bodies": mesh})

    def intersect(self, ray: mi.Ray3f, active: mi.Bool) -> mi.PreliminaryIntersection3f:
        """Finds the first exit surface along rays in the world; `shape_index` is the lamp's."""

        def pass_hull(
            start: mi.Float, found: mi.PreliminaryIntersection3f, going: mi.Bool
        ) -> tuple[mi.Float, mi.PreliminaryIntersection3f, mi.Bool]:
            # The next hull on the way, also if only its far side is
            onward = mi.Ray3f(dr.fma(ray.d, start, ray.o), ray.d)
            onward.maxt = ray.maxt - start + self._largest
            crossing = self._hulls.ray_intersect_preliminary(onward, active=going)
            met = going & crossing.is_valid()
            lamp = dr.gather(mi.UInt32, self._numbers, crossing.prim_index // len(FACES), met)

            # The ray before the lamp's body, in units of its radius
            frame, offset = self._place(lamp, met)
            o, d = frame.point_to_local(ray.o), frame.direction_to_local(ray.d)
            along = -dr.dot(mi.Vector3f(o), d)
            off_axis = dr.squared_norm(dr.fma(d, along, mi.Vector3f(o)))
            half = dr.safe_sqrt(SHELL**2 - off_axis)
            before = dr.maximum(along - half, 0)
            own = mi.Ray3f(dr.fma(d, before, o) + offset, d)
            own.maxt = dr.minimum(along + half, ray.maxt / frame.scale) - before
            crosses = met & (off_axis < SHELL**2) & (own.maxt > 0)
            hit = self._scene.ray_intersect_preliminary(own, active=crosses)
            hits = crosses & hit.is_valid()
            hit.t = (before + hit.t) * frame.scale
            hit.shape_index = lamp

            # Behind the hull
            beyond = (along + dr.safe_sqrt(REACH**2 - off_axis)) * frame.scale
            least = start + crossing.t
            start = dr.maximum(beyond, least + (1 + least) * STEP)
            return start, dr.select(hits, hit, found), met & ~hits & (start < ray.maxt)

        none = dr.zeros(mi.PreliminaryIntersection3f)
        none.t = mi.Float(dr.inf)
        _, found, _ = dr.while_loop(
            (mi.Float(0), none, mi.Bool(active)),
            lambda start, found, going: going,
            pass_hull,
            label="hulls of lamps",
        )
        return found

    def to_world(
        self, si: mi.SurfaceInteraction3f, lamp: mi.UInt32, d: mi.Vector3f, active: mi.Bool
    ) -> mi.SurfaceInteraction3f:
        """Points of bodies, moved to lamps.

        Arguments:
            d: Direction of the ray in the world that met it.
        """
        frame, offset = self._place(lamp, active)
        moved, turned = mi.SurfaceInteraction3f(si), frame.direction_to_world
        moved.p = frame.point_to_world(si.p - offset)
        moved.n = mi.Normal3f(turned(mi.Vector3f(si.n)))
        moved.sh_frame.n = mi.Normal3f(turned(mi.Vector3f(si.sh_frame.n)))
        moved.dp_du, moved.dp_dv = turned(si.dp_du * frame.scale), turned(si.dp_dv * frame.scale)
        moved.initialize_sh_frame()
        moved.wi = moved.to_local(-d)
        return dr.select(active, moved, si)

    def _place(self, lamp: mi.UInt32, active: mi.Bool) -> tuple[Frame, mi.Vector3f]:
        """A lamp's sphere as a frame, and where its kind's body is."""
        x, y, z, rest = (
            dr.gather(mi.Vector4f, self._table, lamp * PACKETS + k, active) for k in range(PACKETS)
        )
        centre = mi.Point3f(x.w, y.w, z.w)
        return Frame(x.xyz, y.xyz, z.xyz, centre, rest.w), rest.xyz


def _alone(kind: Kind, offset: np.ndarray) -> Placement:
    """A kind's body, its sphere of radius one."""
    sphere = kind.luminaire.sphere
    return Placement(np.eye(3), 1 / sphere.radius, offset - np.array(sphere.center) / sphere.radius)


def _offsets(count: int) -> np.ndarray:
    """Places apart from each other, near the origin where numbers are finest: [count, 3]."""
    side = int(np.ceil(count ** (1 / 3)))
    grid = np.stack(np.meshgrid(*3 * [np.arange(side) - (side - 1) // 2]), -1).reshape(-1, 3)
    return SPACING * grid[:count]


def _row(emitter: PureLightEmitter, offset: np.ndarray) -> np.ndarray:
    """What `_place` looks up: [PACKETS, 4]."""
    sphere, row = emitter.sphere(), np.zeros((PACKETS, 4))
    row[:3, :3], row[:3, 3] = emitter.placement.rotation, sphere.center
    row[3] = *offset, sphere.radius
    return row


def _icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Corners of the icosahedron around the unit sphere [12, 3], and its faces [20, 3]."""
    golden = (1 + 5**0.5) / 2
    plane = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)])
    corners = np.concatenate([np.roll(plane, k, axis=1) for k in range(3)])
    length = np.linalg.norm(corners[:, None] - corners, axis=-1)
    faces = [f for f in combinations(range(12), 3) if np.allclose(length[f, np.roll(f, 1)], 2)]
    inner = np.linalg.norm(corners[faces[0], :].mean(axis=0))
    return corners / inner, np.array(faces)


CORNERS, FACES = _icosahedron()


def _hulls(centres: np.ndarray, radii: np.ndarray) -> mi.Mesh:
    """A hull around each sphere, one after the other."""
    corners = centres[:, None] + radii[:, None, None] * CORNERS
    faces = np.arange(len(radii))[:, None, None] * len(CORNERS) + FACES
    mesh = mi.Mesh("hulls", corners.shape[0] * len(CORNERS), len(radii) * len(FACES))
    params = mi.traverse(mesh)
    params["vertex_positions"] = corners.astype(np.float32).ravel()
    params["faces"] = faces.astype(np.uint32).ravel()
    params.update()
    return mesh
