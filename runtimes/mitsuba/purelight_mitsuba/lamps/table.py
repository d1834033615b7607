"""All lamps of a scene: where they hang, and which of them to aim at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.exits import ExitSurfaces, Hit
from purelight_mitsuba.lamps.frame import Frame
from purelight_mitsuba.lamps.lamp_choice import NONE, LampChoice
from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.lamps.spheres import meeting, spheres
from purelight_mitsuba.sampling.surface_sampler import SurfaceSampler

COLUMNS = 5  # Packets of four floats per lamp.
TOUCHING = 1.001  # Times both radii, within which spheres count as meeting.
OVERLAPPING = 64  # Bits of the mask in which a ray notes the overlapping lamps it has passed.


@dataclass
class Place(Frame):
    """One lamp per lane.

    Arguments:
        bit: Of `passed` masks; zero for a lamp whose bounding sphere meets no other.
    """

    dimmer: mi.Float
    asset: mi.UInt32
    bit: mi.UInt64
    centre: mi.Point3f
    radius: mi.Float

    def radii(self, p: mi.Point3f) -> mi.Float:
        """How many radii a point is away from the centre."""
        return dr.norm(p - self.centre) / self.radius


class Lamps:
    """The lamps of a scene on the device.

    Arguments:
        emitters: The lamps, at least one.
        room: The scene without them, which CUDA needs to share its ray-tracing pipeline.
        groups: Names of light groups to keep apart, the first one of Mitsuba's own emitters.

    Attributes:
        luminaires: The different bundles among them.
        exits: Their exit surfaces.
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
        places = _places(emitters, self.luminaires)
        self._places = device_array(mi.Float, places)
        self.overlapping = bool((places[:, 3, 3] >= 0).any())
        self.exits = ExitSurfaces(emitters, room)
        self.surface = SurfaceSampler([luminaire.surface for luminaire in self.luminaires])
        self.dark = not any(e.level * e.luminaire.power > 0 for e in emitters)
        self._choice = None if self.single or self.dark else LampChoice(emitters)

    def intersect(self, ray: mi.Ray3f, active: mi.Bool) -> Hit:
        """Finds the first exit surface along rays in the world."""
        return self.exits.intersect(ray, active)

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

    # Tables

    def group(self, lamp: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """Looks up the light groups of lamps."""
        return dr.gather(mi.UInt32, self._groups, lamp, active) if self.groups else mi.UInt32(0)

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


def _places(emitters: Sequence[PureLightEmitter], luminaires: list[Luminaire]) -> np.ndarray:
    """The table behind `Place`: [L, COLUMNS, 4]."""
    table = np.zeros((len(emitters), COLUMNS, 4))
    for row, emitter in zip(table, emitters, strict=True):
        placement, luminaire = emitter.placement, emitter.luminaire
        row[:3, :3], row[:3, 3] = placement.rotation, placement.translation
        row[3, :3] = placement.scale, emitter.level, luminaires.index(luminaire)
    table[:, 4, :3], table[:, 4, 3] = centres, radii = spheres(emitters)
    table[:, 3, 3] = _bits(centres, radii)
    return table


def _bits(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Numbers the lamps whose bounding spheres meet another's; -1 for the others."""
    overlapping = meeting(centres, radii, TOUCHING)
    if overlapping.sum() > OVERLAPPING:
        raise PureLightError(
            f"{overlapping.sum()} lamps have overlapping bounding spheres, but at most "
            f"{OVERLAPPING} may; move lamps apart or train groups of them as one lamp"
        )
    return np.where(overlapping, np.cumsum(overlapping) - 1, -1)
