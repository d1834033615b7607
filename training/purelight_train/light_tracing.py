"""Light tracing (paper Sec. 3.2, Eq. 6-7): paths from the emitters until they leave the lamp.

Each path that escapes leaves one exit record: its last surface vertex, its direction, and its RGB
weight f/q. Their mean over all emitted paths is the flux.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_train.exit_records import ExitRecords

MAX_DEPTH = 256
ROULETTE_DEPTH = 8
BATCH = 1 << 20


@dr.syntax
def trace_paths(scene: Any, sampler: Any) -> tuple[Any, ...]:
    """One wavefront of paths from the emitters.

    Light carries importance, so dielectrics conserve its power without an eta² factor. Shading
    normals are corrected for (Veach 1997, p. 155), as in Mitsuba's `ptracer`.

    Returns:
        position, geometric normal, direction, weight (W), whether it escaped, and the number of
        scattering vertices (none for light straight from an emitter).
    """
    context = mi.BSDFContext(mi.TransportMode.Importance)
    ray, weight, _ = scene.sample_emitter_ray(
        mi.Float(0), sampler.next_1d(), sampler.next_2d(), sampler.next_2d(), True
    )
    emitted = dr.max(weight)
    position, normal = mi.Point3f(ray.o), dr.zeros(mi.Normal3f)
    depth = mi.UInt32(0)
    active = emitted > 0
    escaped = mi.Bool(False)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False)
        escaped |= active & ~si.is_valid()
        active &= si.is_valid()
        # Scatter, with the adjoint correction for shading normals
        bsdf = si.bsdf(ray)
        sample, value = bsdf.sample(
            context, si, sampler.next_1d(active), sampler.next_2d(active), active
        )
        direction = si.to_world(sample.wo)
        null = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        shading_in, shading_out = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(sample.wo)
        true_in, true_out = dr.dot(si.n, -ray.d), dr.dot(si.n, direction)
        same_side = (true_in * shading_in > 0) & (true_out * shading_out > 0)
        correction = dr.abs((shading_in * true_out) / (shading_out * true_in))
        factor = dr.select(null, 1, dr.select(same_side, correction, 0))
        weight = dr.select(active, weight * value * factor, weight)
        active &= dr.max(weight) > 0
        # The last vertex that is not a null surface is the exit point
        vertex = active & ~null
        position = dr.select(vertex, si.p, position)
        normal = dr.select(vertex, si.n, normal)
        ray = dr.select(active, si.spawn_ray(direction), ray)
        depth = dr.select(vertex, depth + 1, depth)
        # Roulette on the power left of what was emitted
        roulette = active & (depth > ROULETTE_DEPTH)
        survival = dr.clip(dr.max(weight) / emitted, 0.05, 0.95)
        weight = dr.select(roulette, weight / survival, weight)
        active &= ~roulette | (sampler.next_1d(active) < survival)
        active &= depth < MAX_DEPTH
    return position, normal, ray.d, weight, escaped, depth


def trace_records(
    scene: Any, paths: int, seed: int, progress: Callable[[int], None] = lambda _: None
) -> ExitRecords:
    """Trace `paths` paths and gather the exit records of those that escape.

    Arguments:
        scene: a lamp's scene (`luminaire.load_luminaire`).
        paths: number of emitted paths, rounded up to whole batches.
        seed: of the random numbers; the same seed gives the same records on one machine.
        progress: called with the paths done so far.

    Raises:
        PureLightError: nothing escapes the lamp.
    """
    parts: list[ExitRecords] = []
    batches = -(-paths // BATCH)
    for batch in range(batches):
        parts.append(_trace_batch(scene, seed * 65_537 + batch))
        progress((batch + 1) * BATCH)
    records = ExitRecords.concatenate(parts)
    if not records.flux.max() > 0:
        raise PureLightError(
            "the lamp emits nothing that escapes; check its emitters' radiance and that they "
            "face outwards"
        )
    return records


def _trace_batch(scene: Any, seed: int) -> ExitRecords:
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed & 0xFFFFFFFF, BATCH)
    traced = trace_paths(scene, sampler)
    dr.eval(traced)  # once, or every array below would run the loop again
    position, normal, direction, weight, escaped, depth = traced
    finite = dr.all(dr.isfinite(weight)) & dr.all(dr.isfinite(position))
    finite &= dr.all(dr.isfinite(direction))
    keep = escaped & finite & (dr.max(weight) > 0)
    dropped = int(dr.count(escaped & ~finite)[0])
    index = dr.compress(keep)

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
        dropped=dropped,
    )
