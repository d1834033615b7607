"""The lamp's radiance as seen from shading points: what the sampler and the fast map learn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.measures import cap, cap_to_direction
from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Float, Radiance, look

SIDE = 8
EVEN = SIDE * SIDE  # samples of a point
POINT_BATCH = 1 << 13


def shading_points(description: Description, count: int, rng: np.random.Generator) -> Float:
    """Points between the bounding sphere and r_max radii: [count, 3].

    Half are uniform in volume as in the paper, half logarithmic in distance: a volume puts less
    than one point in a hundred within three radii, where the field changes most.
    """
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    u = rng.random(count)
    volume = (1 + u * (description.r_max**3 - 1)) ** (1 / 3)
    distance = np.where(np.arange(count) % 2 == 0, volume, description.r_max**u)
    distance = np.maximum(distance, 1.0005) * description.sphere.radius
    point = np.asarray(description.sphere.center) + distance[:, None] * direction
    return point.astype(np.float32)


def lit_points(
    description: Description, records: ExitRecords, count: int, rng: np.random.Generator
) -> Float:
    """Points where traced light goes, in proportion to it, logarithmic in distance.

    Returns:
        [count, 3] in metres, between the bounding sphere and r_max radii.
    """
    escaped = records.take(records.escaped)
    power = np.cumsum(escaped.weight.astype(np.float64) @ LUMINANCE)
    drawn = np.searchsorted(power, rng.random(count) * power[-1]).clip(max=len(power) - 1)
    distance = np.maximum(description.r_max ** rng.random(count), 1.0005)
    sphere = description.sphere
    toward = escaped.take(drawn).crossings(sphere, distance).astype(np.float64)
    point = np.asarray(sphere.center) + sphere.radius * distance[:, None] * toward
    return point.astype(np.float32)


def learned_points(
    description: Description, records: ExitRecords, count: int, rng: np.random.Generator
) -> Float:
    """What sampler and fast map learn from: two points of all sides, then one that is lit.

    A beam of some degrees meets one point of all sides in a thousand, so that little would be
    learned of what it looks like.
    """
    lit = count // 3 if records.flux.any() else 0
    even = shading_points(description, count - lit, rng)
    point = np.concatenate((even, lit_points(description, records, lit, rng)))
    return rng.permutation(point)


@dataclass(frozen=True)
class CapSamples:
    r"""What shading points see in directions of their caps.

    Their sums over any part of the cap's square estimate :math:`\int L\,dz` there: many points with
    few samples each tell more of a field that changes smoothly than few points with many.

    Arguments:
        point: [P, 3].
        square: [P, K, 2] coordinates in the cap's square.
        radiance: [P, K, 3] towards the point, times the sample's weight.
    """

    point: Float
    square: Float
    radiance: Float

    @staticmethod
    def gather(
        description: Description,
        surface: ExitSurface,
        radiance: Radiance,
        point: Float,
        rng: np.random.Generator,
        progress: Callable[[int], None] = lambda _: None,
    ) -> CapSamples:
        """Look at the lamp from points [P, 3], in each of 8 x 8 cells once: K = 64."""
        count = len(point)
        column, row = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
        corner = np.stack((column, row), -1).reshape(1, EVEN, 2)
        square = ((corner + rng.random((count, EVEN, 2))) / SIDE).astype(np.float32)
        value = np.zeros((count, EVEN, 3), np.float32)
        for i in range(0, count, POINT_BATCH):
            part = slice(i, i + POINT_BATCH)
            direction = cap_directions(description, point[part], square[part])
            seen = look(surface, radiance, np.repeat(point[part], EVEN, 0), direction)
            value[part] = seen.reshape(-1, EVEN, 3) / EVEN
            progress(min(i + POINT_BATCH, count))
        return CapSamples(point, square, value)

    def luminance(self) -> Float:
        """[P, K]."""
        return (self.radiance @ LUMINANCE).astype(np.float32)


def cap_directions(description: Description, point: Float, square: Float) -> Float:
    """Directions of cap coordinates [P, K, 2] seen from points [P, 3]: [P K, 3]."""
    repeated = point.repeat(square.shape[1], 0).astype(np.float64)
    u = square.reshape(-1, 2).astype(np.float64)
    return cap_to_direction(u, cap(repeated, description.sphere)).astype(np.float32)
