"""Transmittance of lines through a lamp: what the transparency network learns.

A viewer sees along a straight line what is behind the lamp. Smooth glass bends light and bends it
back, so the line stays straight, and each interface that it crosses lets through what Fresnel's
equations say for the angle that the line has on the side of the *lower* index: that angle exists
at every interface, and the transmittance is the same both ways. Light that two parallel faces
reflect goes on along the line, so that a wall of reflectance R a face lets (1 - R) / (1 + R)
through.

What rough glass or a medium scatters leaves the line. It is followed on its real way, and counts if
it leaves the lamp into the half-space ahead: before an even background that is what a viewer sees.
What the first surface reflects is no transmission, whatever becomes of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.interfaces import Interfaces
from purelight_train.light.media import Flight, Media
from purelight_train.light.rays import leave, scene_extent

MAX_DEPTH = 256
MAX_EVENTS = 1 << 12  # surfaces and collisions with media together
PARALLEL = 0.99  # cosine between normals; two such faces turn light by up to 16 degrees
BATCH = 1 << 20
STRAIGHT = 0b110_0001  # mi.BSDFFlags.Null | DeltaReflection | DeltaTransmission


class Materials:
    """What lines through a scene need of it. Not a dataclass, see `light_tracing.Lamp`."""

    def __init__(self, scene: mi.Scene) -> None:
        self.scene = scene
        self.extent = dr.opaque(mi.Float, scene_extent(scene))
        self.media = Media(scene, scattering=True)
        self.interfaces = Interfaces(scene)


@dataclass
class Light:
    """Light on a line, or what was scattered out of it.

    Arguments:
        weight: what is left of it.
        forward: whether it goes on along the line, not back.
        direction: in which it really goes, unit vector; the line's own outside of dense media.
        mirror: normal of the face that reflected it last.
        scattered: whether it has left the line.
    """

    weight: mi.Color3f
    forward: mi.Bool
    direction: mi.Vector3f
    mirror: mi.Normal3f
    scattered: mi.Bool

    def along(self, line: mi.Vector3f) -> mi.Vector3f:
        """The direction in which its next surface is looked for."""
        on_line = dr.select(self.forward, line, -line)
        return dr.select(self.scattered, self.direction, on_line)


@dataclass(frozen=True)
class Passing:
    """Random transmittances of lines, [N, 3]: of all that passes, and of what was scattered."""

    all: NDArray[np.float32]
    scattered: NDArray[np.float32]


@dr.syntax
def _transmitted(lamp: Materials, ray: mi.Ray3f, sampler: mi.Sampler) -> tuple[mi.Color3f, mi.Bool]:
    """The transmittance of lines, and whether that is light which has left its line."""
    line, medium = mi.Vector3f(ray.d), dr.zeros(mi.MediumPtr)
    light = Light(
        mi.Color3f(1), mi.Bool(True), mi.Vector3f(ray.d), dr.zeros(mi.Normal3f), mi.Bool(False)
    )
    depth, events, active = mi.UInt32(0), mi.UInt32(0), mi.Bool(True)
    while active:
        si = lamp.scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        flight = _fly(lamp, light, medium, ray, si, sampler, active)
        light.weight = dr.select(active, flight.weight, light.weight)
        met = active & si.is_valid() & ~flight.collided
        light = dr.select(met, _cross(lamp, light, line, si, depth == 0, sampler, met), light)
        onward = light.along(line)
        medium = lamp.media.behind(si, onward, medium, met)
        ray = dr.select(met, leave(si.p, si.n, onward, lamp.extent), ray)
        depth = dr.select(met, depth + 1, depth)
        if dr.hint(lamp.media.present, mode="scalar"):
            event = lamp.media.scatter(medium, flight, sampler)
            light.weight = dr.select(flight.collided, event.weight, light.weight)
            light.direction = dr.select(event.scattered, event.direction, light.direction)
            light.scattered |= event.scattered
            ray = dr.select(flight.collided, mi.Ray3f(flight.interaction.p, event.direction), ray)
        events += 1
        active &= (met | flight.collided) & (dr.max(light.weight) > 0)
        active &= (depth < MAX_DEPTH) & (events < MAX_EVENTS)
    ended = (depth < MAX_DEPTH) & (events < MAX_EVENTS)
    ahead = dr.select(light.scattered, dr.dot(light.direction, line) > 0, light.forward)
    return dr.select(ended & ahead, light.weight, 0), light.scattered


def _fly(
    lamp: Materials, light: Light, medium: mi.MediumPtr, ray: mi.Ray3f,
    si: mi.SurfaceInteraction3f, sampler: mi.Sampler, active: mi.Bool,
) -> Flight:  # fmt: skip
    """Fly to the next surface on the line; as far through a medium as the light really goes."""
    if not lamp.media.present:
        return lamp.media.fly(medium, ray, si.t, light.weight, sampler, active)
    bent = active & ~light.scattered & (medium != dr.zeros(mi.MediumPtr))
    real = dr.select(bent, mi.Ray3f(ray.o, light.direction), ray)
    found = lamp.scene.ray_intersect_preliminary(real, active=bent)
    length = dr.select(bent & found.is_valid(), found.t, si.t)
    return lamp.media.fly(medium, real, length, light.weight, sampler, active)


def _cross(
    lamp: Materials, light: Light, line: mi.Vector3f, si: mi.SurfaceInteraction3f,
    first: mi.Bool, sampler: mi.Sampler, active: mi.Bool,
) -> Light:  # fmt: skip
    """Sample what becomes of light that meets a surface, `first` if it is the first one."""
    bsdf, context = si.bsdf(), mi.BSDFContext(mi.TransportMode.Importance)
    eta = lamp.interfaces.relative(bsdf, si, active)
    smooth = ~light.scattered & ~mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
    on_line = si.to_local(-light.along(line))
    # A smooth interface is asked at the angle of the line, from the side of the lower index
    real = si.to_local(-light.direction)
    real = dr.select(real.z * on_line.z > 0, real, on_line)
    si.wi = dr.select(smooth, dr.select(eta < 1, -on_line, on_line), real)
    sample, weight = bsdf.sample(
        context, si, sampler.next_1d(active), sampler.next_2d(active), active
    )
    through = si.wi.z * sample.wo.z < 0
    straight = ~light.scattered & mi.has_flag(sample.sampled_type, STRAIGHT)
    mirrored = straight & ~through
    # Two reflections by parallel faces turn light back to the line; others are lost to it
    glass = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Transmission)
    parallel = light.forward | (dr.abs(dr.dot(light.mirror, si.n)) > PARALLEL)
    kept = light.scattered | through | (glass & (parallel | ~straight) & ~first)
    forward = light.forward ^ mirrored
    onward = dr.select(forward, line, -line)
    here = dr.select(through, eta, dr.rcp(eta))
    bent = si.to_world(_refracted(si.to_local(onward), here))
    return Light(
        dr.select(kept, light.weight * weight, 0),
        forward,
        dr.select(straight, bent, si.to_world(sample.wo)),
        dr.select(mirrored, si.n, light.mirror),
        light.scattered | ~straight,
    )


def _refracted(direction: mi.Vector3f, eta: mi.Float) -> mi.Vector3f:
    """Direction in a medium of index eta, of light that has `direction` in one of index 1.

    Snell's law about the z axis; media of an index below one leave it as it is.
    """
    sine = mi.Vector2f(direction.x, direction.y) * dr.rcp(dr.maximum(eta, 1))
    cosine = dr.safe_sqrt(1 - dr.squared_norm(sine))
    return mi.Vector3f(sine.x, sine.y, dr.mulsign(cosine, direction.z))


def transmittance_samples(
    scene: mi.Scene, origin: NDArray[np.float32], direction: NDArray[np.float32], seed: int
) -> NDArray[np.float32]:
    """A random transmittance of each line, whose mean is the line's: [N, 3], [N, 3] -> [N, 3].

    Arguments: as those of `transmittance_parts`.
    """
    return transmittance_parts(scene, origin, direction, seed).all


def transmittance_parts(
    scene: mi.Scene, origin: NDArray[np.float32], direction: NDArray[np.float32], seed: int
) -> Passing:
    """Random transmittances of lines, whose means are the lines', and what of that is scattered.

    Arguments:
        scene: that holds only the lamp; its emitters do not count.
        origin: outside of the lamp's solids, in metres.
        direction: from the viewer on, unit vectors.
        seed: of the random numbers.
    """
    lamp, result = Materials(scene), np.empty((len(origin), 3), np.float32)
    scattered = np.zeros(len(origin), bool)
    for batch, start in enumerate(range(0, len(origin), BATCH)):
        part = slice(start, start + BATCH)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed((seed * 65_537 + batch) & 0xFFFFFFFF, len(origin[part]))
        columns = (np.ascontiguousarray(a[part].T) for a in (origin, direction))
        point, toward = columns
        ray = mi.Ray3f(mi.Point3f(point), mi.Vector3f(toward))
        weight, left = _transmitted(lamp, ray, sampler)
        dr.eval(weight, left)
        result[part], scattered[part] = np.array(weight).T, np.array(left)
    found = np.nan_to_num(result, nan=0.0, posinf=1.0)
    return Passing(found, np.where(scattered[:, None], found, 0))
