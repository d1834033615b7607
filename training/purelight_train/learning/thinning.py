r"""Rays that few viewers can meet are few among those that are learned from.

Between bodies that nearly touch, light goes from one to the next many times before it escapes.
Fitted as it comes, a small network spends its weights there, on what nobody sees. A ray counts for
the viewers that it may meet: one if it escapes, else by the way t that it goes, over the radius R
of the bounding sphere,

.. math:: g = \min(1, \max(t / R, g_0)).

Photons and reference rays stay with this probability, both told by the exit surface alone, so that
their ratio in any place, and with it what is learned, is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from purelight_train.learning.flux_closure import LIFT
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.exit_records import seen_share
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]
Columns = tuple[Float, ...]
TRIED = 1 << 20  # reference rays whose share is the normalisation


@dataclass(frozen=True)
class Thinning:
    """Chooses which rays from the surface of reference rays stay."""

    references: ReferenceRays

    @property
    def surface(self) -> ExitSurface:
        return self.references.chart.surface

    @cached_property
    def kept(self) -> float:
        """Part of the reference rays that stays in the mean."""
        if not self.surface.concave:
            return 1.0
        rays = self.references.sample(TRIED, np.random.default_rng(0))
        return float(self.share(*rays[:3]).mean())

    def share(self, position: Float, normal: Float, outgoing: Float) -> NDArray[np.float64]:
        """The chance g of rays to stay, three of [N, 3] -> [N]."""
        radius = self.surface.sphere.radius
        lifted, way = position + LIFT * radius * normal, np.full(len(position), np.inf)
        hits = self.surface.intersect(lifted, outgoing)
        way[hits.index] = np.linalg.norm(hits.position - lifted[hits.index], axis=1)
        return seen_share(way, radius)

    def rays(self, columns: Columns, rng: np.random.Generator) -> Columns:
        """Those reference rays that stay, of columns that begin with position, normal, outgoing."""
        if not self.surface.concave:
            return columns
        stays = rng.random(len(columns[0])) < self.share(*columns[:3])
        return tuple(column[stays] for column in columns)

    def photons(self, columns: Columns, rng: np.random.Generator) -> Columns:
        """Those photons that stay; their weights, the last column, allow for how many go.

        The means over what stays of both kinds are then means over all, but for one common factor.
        """
        *rays, weight = self.rays(columns, rng)
        part = len(weight) / max(len(columns[0]), 1)
        return *rays, weight * np.float32(part / self.kept)
