"""Light tracing (paper Sec. 3.2, Eq. 6): paths from the emitters until they leave the lamp.

Each path that escapes leaves one exit record: its last surface vertex, its direction, and its RGB
weight f/q. Their mean over all emitted paths is the flux.

Light that leaves the exit surface and meets the lamp again, as under a shade or between the arms of
a chandelier, is seen by who stands between. Of all such crossings of a path, one is recorded
besides, drawn by its power and weighted for all of them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_train.light.emission import Emission
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.look_back import LookBack
from purelight_train.light.media import Media
from purelight_train.light.rays import leave, scene_extent
from purelight_train.light.scattering import Materials, Scattered

MAX_DEPTH = 256
MAX_EVENTS = 1 << 14  # surfaces and collisions with media together
ROULETTE_DEPTH = 8
BATCH = 1 << 20
Visit = Callable[..., Scattered]  # as `Lamp.scatter`
ABSORBED, ESCAPED, BROKEN, CUT = range(4)  # fates of a path; broken: a value not finite


class Lamp:
    """What the paths of a lamp need of its scene, found once.

    Not a dataclass, which Dr.Jit's loops would take for their state; nor is what it holds.

    Arguments:
        surface: whose crossings are recorded besides the light that escapes; none without.
    """

    def __init__(self, scene: mi.Scene, surface: ExitSurface | None = None) -> None:
        self.scene = scene
        self.extent = dr.opaque(mi.Float, scene_extent(scene))
        self.emission = Emission.of(scene, self.extent)
        self.media = Media(scene, scattering=True)
        self.materials = Materials(scene)
        concave = surface is not None and surface.concave
        self.look_back: Any = LookBack(surface, scene) if surface is not None and concave else None

    def scatter(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, weight: mi.Color3f, sampler: mi.Sampler,
        active: mi.Bool,
    ) -> Scattered:  # fmt: skip
        """`Materials.scatter`, whatever the weight is."""
        return self.materials.scatter(si, ray, sampler, active)


@dataclass
class Exit:
    """Light that leaves a surface.

    Arguments:
        position, normal, shading: of the surface, either side.
        direction: unit vector.
        weight: W per channel.
        depth: surfaces met before; none for light straight from an emitter.
    """

    position: mi.Point3f
    normal: mi.Normal3f
    shading: mi.Normal3f
    direction: mi.Vector3f
    weight: mi.Color3f
    depth: mi.UInt32


@dataclass
class Crossing:
    """One of the crossings of a path so far, drawn by power (weighted reservoir sampling).

    Arguments:
        exit: its weight is the crossing's own.
        free: metres to the next surface.
        total: sum of the powers of all crossings.
    """

    exit: Exit
    free: mi.Float
    total: mi.Float

    def offer(self, other: Exit, free: mi.Float, u: mi.Float, active: mi.Bool) -> Crossing:
        """Take another crossing into account, by a uniform number."""
        power = dr.select(active, dr.sum(other.weight), 0)
        total = self.total + power
        take = active & (u * total < power)
        return Crossing(dr.select(take, other, self.exit), dr.select(take, free, self.free), total)


@dataclass
class Traced:
    """A wavefront of paths at their ends.

    Arguments:
        exit: where each left its last surface; the point is that of the last surface of any kind,
            the first that a viewer meets: light that passes a mask or thin glass straight is seen
            there.
        fate: see above.
        sharp: whether the last event was sharp (`scattering.Materials.scatter`; light of emitters
            without area is, too).
        needle: whether all were, so that light of an emitter without area is infinitely bright.
        crossing: of the exit surface of `Lamp`.
    """

    exit: Exit
    fate: mi.UInt32
    sharp: mi.Bool
    needle: mi.Bool
    crossing: Crossing


@dr.syntax
def trace_paths(lamp: Lamp, sampler: mi.Sampler, visit: Visit | None = None) -> Traced:
    """One wavefront of paths from the emitters.

    Arguments:
        visit: scatters light at a surface, in place of `Lamp.scatter`.
    """
    visit = visit or lamp.scatter
    start = lamp.emission.sample(sampler)
    ray, emitted = start.ray, dr.max(start.weight)
    medium = lamp.media.around(start.emitter, start.shape)
    nowhere, depth, events = dr.zeros(mi.Normal3f), mi.UInt32(0), mi.UInt32(0)
    flown = mi.Float(0)  # metres straight on since the last surface; infinite once scattered
    last = Exit(
        mi.Point3f(start.position), nowhere, nowhere, mi.Vector3f(ray.d), start.weight, depth
    )
    crossing = Crossing(dr.zeros(Exit), mi.Float(0), mi.Float(0))
    fate = dr.select(dr.isfinite(emitted), mi.UInt32(ABSORBED), BROKEN)
    sharp = start.shape == dr.zeros(mi.ShapePtr)
    # Rays of a ray file are samples of a source that has an area
    needle = sharp & mi.has_flag(start.emitter.flags(), mi.EmitterFlags.DeltaPosition)
    active = emitted > 0
    while active:
        si = lamp.scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        flight = lamp.media.fly(medium, ray, si.t, last.weight, sampler, active)
        met = active & ~flight.collided
        fate = dr.select(met & ~si.is_valid(), ESCAPED, fate)
        last.weight = dr.select(active, flight.weight, last.weight)
        met &= si.is_valid()
        if dr.hint(lamp.look_back is not None, mode="scalar"):
            free = flown + si.t
            straight = met & (flown < dr.inf)
            seen = lamp.look_back(last.position, last.direction, 0.5 * free, straight)
            crossing = crossing.offer(last, free, sampler.next_1d(seen), seen)
        # A surface: scatter, and remember it as the exit so far
        event = visit(si, ray, last.weight, sampler, met)
        sharp = dr.select(met, event.sharp, sharp | flight.collided)
        needle &= (~met | event.sharp) & ~flight.collided
        weight = last.weight * event.factor
        left = Exit(si.p, si.n, si.sh_frame.n, event.direction, weight, last.depth + 1)
        last = dr.select(met, left, last)
        medium = lamp.media.behind(si, event.direction, medium, met)
        next_ray = leave(si.p, si.n, event.direction, lamp.extent)
        # A collision with a medium: scatter, or pass on
        if dr.hint(lamp.media.present, mode="scalar"):
            collision = lamp.media.scatter(medium, flight, sampler)
            last.weight = dr.select(flight.collided, collision.weight, last.weight)
            last.direction = dr.select(flight.collided, collision.direction, last.direction)
            onward = mi.Ray3f(flight.interaction.p, collision.direction)
            next_ray = dr.select(flight.collided, onward, next_ray)
            between = dr.select(collision.scattered, dr.inf, flown + flight.interaction.t)
            flown = dr.select(flight.collided, between, dr.select(met, 0, flown))
        active &= met | flight.collided
        sound = dr.all(dr.isfinite(last.weight)) & (
            dr.all(dr.isfinite(next_ray.d)) | (dr.max(last.weight) <= 0)
        )
        fate = dr.select(active & ~sound, BROKEN, fate)
        active &= sound & (dr.max(last.weight) > 0)
        ray = dr.select(active, next_ray, ray)
        # Roulette on the power left of what was emitted; none while all of it is left, or the few
        # paths that total reflection traps for long would come out with huge weights
        roulette = active & (last.depth > ROULETTE_DEPTH)
        survival = dr.clip(dr.max(last.weight) / emitted, 0.05, 1)
        last.weight = dr.select(roulette, last.weight / survival, last.weight)
        active &= ~roulette | (sampler.next_1d(active) < survival)
        events += 1
        fate = dr.select(active & ((last.depth >= MAX_DEPTH) | (events >= MAX_EVENTS)), CUT, fate)
        active &= (last.depth < MAX_DEPTH) & (events < MAX_EVENTS)
    return Traced(last, fate, sharp, needle, crossing)


def trace_records(
    scene: mi.Scene,
    paths: int,
    seed: int,
    progress: Callable[[int], None] = lambda _: None,
    surface: ExitSurface | None = None,
) -> ExitRecords:
    """Trace `paths` paths and gather the exit records of those that escape.

    Warns of paths dropped because a value was not finite, and of paths cut off.

    Arguments:
        scene: a lamp's scene (`luminaire.load_luminaire`).
        paths: number of emitted paths, rounded up to whole batches.
        seed: of the random numbers; the same seed gives the same records on one machine.
        progress: called with the paths done so far.
        surface: whose crossings by light that stays are recorded besides.

    Raises:
        PureLightError: nothing escapes the lamp.
    """
    lamp = Lamp(scene, surface)
    parts: list[ExitRecords] = []
    batches = -(-paths // BATCH)
    for batch in range(batches):
        parts.append(_trace_batch(lamp, seed * 65_537 + batch))
        progress((batch + 1) * BATCH)
    records = ExitRecords.concatenate(parts)
    if not len(records) or not records.flux.max() > 0:
        raise PureLightError(
            "the lamp emits nothing that escapes; check its emitters' radiance and that they "
            "face outwards"
        )
    _warn(records)
    return records


def _warn(records: ExitRecords) -> None:
    if records.dropped:
        warnings.warn(
            f"{records.dropped} of {records.paths} light paths dropped: not finite; check the "
            "lamp's materials and textures",
            stacklevel=3,
        )
    if records.cut > 1e-3 * records.paths:
        warnings.warn(
            f"{records.cut} of {records.paths} light paths cut off after {MAX_DEPTH} surfaces or "
            f"{MAX_EVENTS} collisions; the lamp traps light, and its flux comes out low",
            stacklevel=3,
        )


def _trace_batch(lamp: Lamp, seed: int) -> ExitRecords:
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed & 0xFFFFFFFF, BATCH)
    traced = trace_paths(lamp, sampler)
    dr.eval(traced)  # once, or every array below would run the loop again
    crossing, out = traced.crossing, traced.exit
    escaped = (traced.fate == ESCAPED) & (dr.max(out.weight) > 0)
    finite = dr.all(dr.isfinite(out.position) & dr.isfinite(out.direction))
    finite &= dr.all(dr.isfinite(out.weight))
    needles = dr.select(escaped & finite & traced.needle, dr.sum(out.weight), 0)
    parts = [_records(out, mi.Float(dr.inf), escaped & finite)]
    if lamp.look_back is not None:
        inner = crossing.exit
        inner.weight *= crossing.total / dr.sum(inner.weight)
        sound = dr.all(dr.isfinite(inner.weight)) & (crossing.total > 0)
        parts.append(_records(inner, crossing.free, sound))
    dropped = int(dr.count((traced.fate == BROKEN) | (escaped & ~finite))[0])
    cut = int(dr.count(traced.fate == CUT)[0])
    return replace(
        ExitRecords.concatenate(parts), paths=BATCH, dropped=dropped, cut=cut,
        needles=float(np.array(needles, np.float64).sum()),
    )  # fmt: skip


def _records(exit: Exit, free: mi.Float, active: mi.Bool) -> ExitRecords:
    """The active lanes as records, their normals turned to the side that the light leaves from."""
    index = dr.compress(active)

    def column(value: mi.Point3f | mi.Color3f) -> np.ndarray:
        if dr.width(index) == 0:
            return np.zeros((0, 3), np.float32)
        return np.ascontiguousarray(np.array(dr.gather(type(value), value, index)).T)

    normal = dr.select(dr.dot(exit.normal, exit.direction) < 0, -exit.normal, exit.normal)
    shading = dr.select(dr.dot(exit.shading, normal) < 0, -exit.shading, exit.shading)
    lanes = np.array(index)
    return ExitRecords(
        position=column(exit.position),
        normal=column(normal),
        shading=column(shading),
        direction=column(exit.direction),
        weight=column(exit.weight),
        free=np.broadcast_to(np.array(free, np.float32), BATCH)[lanes],
        bare=np.array(exit.depth)[lanes] == 0,
        paths=0,
    )
