"""Light tracing (paper Sec. 3.2, Eq. 6-7): paths from the emitters until they leave the lamp.

Each path that escapes leaves one exit record: its last surface vertex, its direction, and its RGB
weight f/q. Their mean over all emitted paths is the flux.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_train.light.emission import Emission
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.media import Media
from purelight_train.light.rays import leave, scene_extent
from purelight_train.light.scattering import Materials

MAX_DEPTH = 256
MAX_EVENTS = 1 << 14  # surfaces and collisions with media together
ROULETTE_DEPTH = 8
BATCH = 1 << 20
Visit = Callable[[Any, Any, Any, Any, Any], tuple[Any, Any, Any]]
ABSORBED, ESCAPED, BROKEN, CUT = range(4)  # fates of a path; broken: a value not finite


class Lamp:
    """What the paths of a lamp need of its scene, found once.

    Not a dataclass, which Dr.Jit's loops would take for their state; nor is what it holds.
    """

    def __init__(self, scene: Any) -> None:
        self.scene = scene
        self.extent = dr.opaque(mi.Float, scene_extent(scene))
        self.emission = Emission.of(scene, self.extent)
        self.media = Media(scene, scattering=True)
        self.materials = Materials(scene)

    def scatter(
        self, si: Any, ray: Any, weight: Any, sampler: Any, active: Any
    ) -> tuple[Any, Any, Any]:
        """`Materials.scatter`: direction, factor on the weight, whether the event was sharp."""
        return self.materials.scatter(si, ray, sampler, active)


@dr.syntax
def trace_paths(lamp: Lamp, sampler: Any, visit: Visit | None = None) -> tuple[Any, ...]:
    """One wavefront of paths from the emitters.

    The exit point is the last surface of any kind, the first that a viewer meets: light that
    passes a mask or thin glass straight is seen there.

    Arguments:
        visit: scatters light at a surface, in place of `Lamp.scatter`.

    Returns:
        position, geometric normal, direction, weight (W), fate, the number of surfaces met (none
        for light straight from an emitter), and whether the last event was sharp
        (`Materials.scatter`; light of emitters without area is, too).
    """
    visit = visit or lamp.scatter
    ray, emitter, weight = lamp.emission.sample(sampler)
    emitted = dr.max(weight)
    medium = lamp.media.around(emitter)
    position, normal = mi.Point3f(ray.o), dr.zeros(mi.Normal3f)
    depth, events = mi.UInt32(0), mi.UInt32(0)
    fate = dr.select(dr.isfinite(emitted), mi.UInt32(ABSORBED), BROKEN)
    sharp = emitter.get_shape() == dr.zeros(mi.ShapePtr)
    active = emitted > 0
    while active:
        si = lamp.scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        flight = lamp.media.fly(medium, ray, si.t, weight, sampler, active)
        met = active & ~flight.collided
        fate = dr.select(met & ~si.is_valid(), ESCAPED, fate)
        weight = dr.select(active, flight.weight, weight)
        met &= si.is_valid()
        # A surface: scatter, and remember it as the exit so far
        direction, factor, event = visit(si, ray, weight, sampler, met)
        sharp = dr.select(met, event, sharp | flight.collided)
        weight = dr.select(met, weight * factor, weight)
        position = dr.select(met, si.p, position)
        normal = dr.select(met, si.n, normal)
        medium = lamp.media.behind(si, direction, medium, met)
        next_ray = leave(si.p, si.n, direction, lamp.extent)
        depth = dr.select(met, depth + 1, depth)
        # A collision with a medium: scatter, or pass on
        if dr.hint(lamp.media.present, mode="scalar"):
            turned, changed = lamp.media.scatter(medium, flight, sampler)
            weight = dr.select(flight.collided, changed, weight)
            onward = mi.Ray3f(flight.interaction.p, turned)
            next_ray = dr.select(flight.collided, onward, next_ray)
        active &= met | flight.collided
        sound = dr.all(dr.isfinite(weight)) & (
            dr.all(dr.isfinite(next_ray.d)) | (dr.max(weight) <= 0)
        )
        fate = dr.select(active & ~sound, BROKEN, fate)
        active &= sound & (dr.max(weight) > 0)
        ray = dr.select(active, next_ray, ray)
        # Roulette on the power left of what was emitted; none while all of it is left, or the few
        # paths that total reflection traps for long would come out with huge weights
        roulette = active & (depth > ROULETTE_DEPTH)
        survival = dr.clip(dr.max(weight) / emitted, 0.05, 1)
        weight = dr.select(roulette, weight / survival, weight)
        active &= ~roulette | (sampler.next_1d(active) < survival)
        events += 1
        fate = dr.select(active & ((depth >= MAX_DEPTH) | (events >= MAX_EVENTS)), CUT, fate)
        active &= (depth < MAX_DEPTH) & (events < MAX_EVENTS)
    return position, normal, ray.d, weight, fate, depth, sharp


def trace_records(
    scene: Any, paths: int, seed: int, progress: Callable[[int], None] = lambda _: None
) -> ExitRecords:
    """Trace `paths` paths and gather the exit records of those that escape.

    Warns of paths dropped because a value was not finite, and of paths cut off.

    Arguments:
        scene: a lamp's scene (`luminaire.load_luminaire`).
        paths: number of emitted paths, rounded up to whole batches.
        seed: of the random numbers; the same seed gives the same records on one machine.
        progress: called with the paths done so far.

    Raises:
        PureLightError: nothing escapes the lamp.
    """
    lamp = Lamp(scene)
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
    position, normal, direction, weight, fate, depth, _ = traced
    escaped = (fate == ESCAPED) & (dr.max(weight) > 0)
    finite = dr.all(dr.isfinite(position) & dr.isfinite(direction) & dr.isfinite(weight))
    index = dr.compress(escaped & finite)

    def column(value: Any) -> np.ndarray:
        if dr.width(index) == 0:
            return np.zeros((0, 3), np.float32)
        return np.ascontiguousarray(np.array(dr.gather(type(value), value, index)).T)

    # Turn the geometric normal to the side the light leaves from
    normal = dr.select(dr.dot(normal, direction) < 0, -normal, normal)
    return ExitRecords(
        position=column(position),
        normal=column(normal),
        direction=column(direction),
        weight=column(weight),
        bare=np.array(depth)[np.array(index)] == 0,
        paths=BATCH,
        dropped=int(dr.count((fate == BROKEN) | (escaped & ~finite))[0]),
        cut=int(dr.count(fate == CUT)[0]),
    )
