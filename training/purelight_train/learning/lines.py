"""Lines through a lamp, drawn where its light is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from purelight_format.geometry import BoundingSphere
from purelight_train.light.exit_surface import inward_rays

Float = NDArray[np.float32]
UNIFORM_SHARE = 0.5
CLUSTERS, LEAST_RADIUS = 16, 0.02
FAR = 1.0001  # radii; where `inward_rays` start


@dataclass(frozen=True)
class Lines:
    r"""Oriented lines through a lamp's bounding sphere.

    Half are uniform; the others pass through a ball around an emitter, a uniform point of it in a
    uniform direction. The measure of lines is area times solid angle, which is also that of light
    leaving a surface, dA cos(theta) domega. In it, with ball b of volume V drawn with chance q and
    c the length of the line inside the ball, and the sphere's radius R,

    .. math:: p = \frac{q_0}{4 \pi^2 R^2} + \sum_b \frac{q_b\,c_b}{4 \pi V_b}

    Most light of a filament in clear glass goes along lines through the filament: few uniform
    lines meet it, and their mean is known ten times as badly.

    Arguments:
        sphere: bounding sphere of the exit surface.
        balls: around the emitters.
        power: of each, in any unit: [B].
    """

    sphere: BoundingSphere
    balls: Sequence[BoundingSphere] = ()
    power: Sequence[float] = ()

    @cached_property
    def _chance(self) -> NDArray[np.float64]:
        """Of uniform lines, then of each ball: [1 + B]."""
        power = np.asarray(self.power, np.float64)
        total = power.sum() if len(power) else 0.0
        if not total > 0:
            return np.ones(1)
        return np.concatenate([[UNIFORM_SHARE], (1 - UNIFORM_SHARE) * power / total])

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Float, Float]:
        """Points on the sphere, where viewers stand, and directions into it: two of [count, 3]."""
        origin, direction = inward_rays(self.sphere, count, rng, cosine=True)
        chosen = rng.choice(len(self._chance), size=count, p=self._chance) - 1
        through = np.flatnonzero(chosen >= 0)
        if len(through):
            point = self._points(chosen[through], rng)
            toward = _unit(rng.normal(size=point.shape))
            offset = point - np.asarray(self.sphere.center)
            along = np.einsum("nd,nd->n", offset, toward)
            rest = np.maximum((FAR * self.sphere.radius) ** 2 - (offset**2).sum(1) + along**2, 0)
            origin[through] = point - (along + np.sqrt(rest))[:, None] * toward
            direction[through] = toward
        return origin, direction

    def _points(self, ball: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.float64]:
        """Uniform points of balls, by their index: [N, 3]."""
        centre = np.array([b.center for b in self.balls])[ball]
        radius = np.array([b.radius for b in self.balls])[ball]
        length = radius * rng.random(len(ball)) ** (1 / 3)
        return centre + length[:, None] * _unit(rng.normal(size=centre.shape))

    def density(self, origin: Float, direction: Float) -> NDArray[np.float64]:
        """p of lines, in 1/(m² sr): two of [N, 3] -> [N]."""
        result = np.full(
            len(origin), self._chance[0] / (2 * math.pi * FAR * self.sphere.radius) ** 2
        )
        for chance, ball in zip(self._chance[1:], self.balls, strict=False):
            offset = np.asarray(ball.center) - origin.astype(np.float64)
            along = np.einsum("nd,nd->n", offset, direction)
            off_axis = np.maximum((offset**2).sum(1) - along**2, 0)
            chord = 2 * np.sqrt(np.maximum(ball.radius**2 - off_axis, 0))
            result += chance * chord / (16 / 3 * math.pi**2 * ball.radius**3)
        return result


def lines_through(sphere: BoundingSphere, origins: NDArray[np.float64]) -> Lines:
    """Lines through clusters of points where a lamp's light begins, [N, 3], drawn by power.

    A ball is made at least a fiftieth of the lamp large: walls of glass shift what is behind them.
    """
    centres, cluster = kmeans2(origins, CLUSTERS, minit="++", seed=0, missing="warn")
    balls, power = [], []
    for index, centre in enumerate(centres):
        own = origins[cluster == index]
        if len(own):
            reach = np.sqrt(((own - centre) ** 2).sum(1).max())
            radius = float(max(1.2 * reach, LEAST_RADIUS * sphere.radius))
            x, y, z = centre.tolist()
            balls.append(BoundingSphere((x, y, z), radius))
            power.append(float(len(own)))
    return Lines(sphere, balls, power)


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)
