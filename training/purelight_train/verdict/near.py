"""Light at places inside a concave lamp's bounding sphere, where a table or a wall may be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface, cosine_directions
from purelight_train.light.radiance_field import Float, Radiance, look
from purelight_train.truth.picture import Image, Passes, Picture

MOST, LEAST = 16, 4  # places; fewer tell nothing of a lamp
TRIALS, RAYS = 128, 1 << 9
RADIUS = 0.1  # of a place, in the lamp's radii
OPEN = 0.05  # part of a place's directions that must lead out of the lamp
SEEN = 0.02  # part that must meet it
PASS, PASSES = 1 << 12, 4  # rays of the student at each place


@dataclass(frozen=True)
class Near:
    """Disks that face what they see of the lamp.

    Arguments:
        centre, normal: [P, 3].
        radius: in metres.
    """

    surface: ExitSurface
    centre: Float
    normal: Float
    radius: float

    @staticmethod
    def of(surface: ExitSurface, rng: np.random.Generator) -> Near | None:
        """Some random places outside all bodies; None where there are hardly any.

        From within glass or a closed globe one sees the back of its surface, or no way out.
        """
        if not surface.concave:
            return None
        sphere, radius = surface.sphere, RADIUS * surface.sphere.radius
        at = np.asarray(sphere.center) + sphere.radius * _in_ball(TRIALS, rng)
        direction = _unit(rng.normal(size=(TRIALS, RAYS, 3))).astype(np.float32)
        origin = np.repeat(at.astype(np.float32), RAYS, 0)
        hits = surface.intersect(origin, direction.reshape(-1, 3))
        fair = hits.front | surface.two_sided[hits.triangle]
        away = np.linalg.norm(hits.position - origin[hits.index], axis=1)
        met = np.zeros((TRIALS, RAYS), bool)
        met.flat[hits.index] = True
        bad = np.bincount(hits.index[~fair | (away < 1.5 * radius)] // RAYS, minlength=TRIALS) > 0
        good = ~bad & (met.mean(1) > SEEN) & (met.mean(1) < 1 - OPEN)
        normal = np.einsum("tr,trd->td", met.astype(np.float32), direction)
        good &= np.linalg.norm(normal, axis=1) > 1e-2 * RAYS
        chosen = np.flatnonzero(good)[:MOST]
        if len(chosen) < LEAST:
            return None
        return Near(surface, at[chosen].astype(np.float32), _unit(normal[chosen]), radius)

    def caught(self, records: ExitRecords) -> Image:
        """Irradiance of recorded light, what meets the lamp again included: [P, 1, 3] in W/m²."""
        sums = np.zeros((len(self.centre), 1, 3))
        for k, (centre, normal) in enumerate(zip(self.centre, self.normal, strict=True)):
            facing = records.direction @ normal
            with np.errstate(divide="ignore", invalid="ignore"):
                reach = ((centre - records.position) @ normal) / facing
                at = records.position + reach[:, None] * records.direction - centre
                near = np.einsum("nd,nd->n", at, at) < self.radius**2
            met = (facing < 0) & (reach > 0) & (reach < records.free) & near
            sums[k, 0] = records.weight[met].sum(0, dtype=np.float64)
        sums /= records.paths * math.pi * self.radius**2
        return sums

    def of_student(self, radiance: Radiance, rng: np.random.Generator) -> Picture:
        """Irradiance of a radiance field."""
        sums = Passes()
        for _ in range(PASSES):
            normal = np.repeat(self.normal, PASS, 0)
            toward = cosine_directions(normal, rng)
            seen = look(self.surface, radiance, self._points(normal, rng), toward)
            sums.add(math.pi * seen.reshape(-1, PASS, 3).mean(1, dtype=np.float64)[:, None])
        return sums.picture()

    def _points(self, normal: Float, rng: np.random.Generator) -> Float:
        """Even points of the disks."""
        across = np.cross(normal, rng.normal(size=normal.shape))
        reach = self.radius * np.sqrt(rng.random((len(normal), 1)))
        offset = reach * _unit(across)
        points: Float = (np.repeat(self.centre, PASS, 0) + offset).astype(np.float32)
        return points


def _in_ball(count: int, rng: np.random.Generator) -> Image:
    inside: Image = _unit(rng.normal(size=(count, 3))) * rng.random((count, 1)) ** (1 / 3)
    return inside


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    result: NDArray[Any] = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result
