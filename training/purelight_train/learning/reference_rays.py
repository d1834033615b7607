"""Rays to compare photons with: drawn where the light is, by a density that is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from purelight_train.learning.density_tree import DensityTree
from purelight_train.light.exit_records import ExitRecords, seen_share
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.ray_chart import RayChart

Float = NDArray[np.float32]
LIGHT_SHARE = 0.5
MOST = 1 << 20  # records that are learned from


@dataclass(frozen=True)
class ReferenceRays:
    r"""Rays that leave an exit surface, some of them uniform and some drawn as light was traced.

    Uniform is by area and projected solid angle, as even points of the chart are. With u the
    uniform density, p that of the light, and a its share,

    .. math:: \rho = q / u = 1 - a + a\,p / u

    is known of every ray, and :math:`E_u[f] = E_q[f / \rho]`. Light that leaves glass in narrow
    beams is rarely met by uniform rays: their few large values would make most of the noise of a
    loss, and clipped gradients a bias of it.

    Arguments:
        light_share: a; all rays are uniform with 0.
    """

    chart: RayChart
    light: DensityTree
    light_share: float = LIGHT_SHARE

    @staticmethod
    def of(
        surface: ExitSurface, records: ExitRecords, triangle: NDArray[np.int64]
    ) -> ReferenceRays:
        """From light as a viewer meets it, and the triangle of each record (`settle`)."""
        chart = RayChart(surface)
        # Light that escapes comes first
        some = np.random.default_rng(0).permutation(len(records))[:MOST]
        part = records.take(some)
        place = chart.place(part.position, part.normal, part.direction, triangle[some])
        power = part.weight.sum(1, dtype=np.float64) * seen_share(part.free, surface.sphere.radius)
        return ReferenceRays(chart, DensityTree.of(place, power))

    @property
    def least_ratio(self) -> float:
        """No ray's rho is less."""
        return 1 - self.light_share

    @cached_property
    def _log_ratio(self) -> Float:
        """Log of rho in each leaf."""
        ratio = 1 - self.light_share + self.light_share * self.light.density
        return np.log(ratio).astype(np.float32)

    def log_ratio(
        self, position: Float, normal: Float, outgoing: Float, triangle: NDArray[np.int64]
    ) -> Float:
        """Log of rho of rays, three of [N, 3] and their triangles [N]: [N]."""
        place = self.chart.place(position, normal, outgoing, triangle)
        return self._log_ratio[self.light.leaves(place)]

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Float, Float, Float, Float]:
        """Position, normal, outgoing direction, each [count, 3], and log of rho, [count]."""
        lit = round(self.light_share * count)
        place = np.concatenate([rng.random((count - lit, 4)), self.light.sample(lit, rng)])
        place = place[rng.permutation(count)]
        return *self.chart.rays(place), self._log_ratio[self.light.leaves(place)]
