"""Exit records: where, whereto and with how much power light left the lamp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]


@dataclass(frozen=True)
class ExitRecords:
    """Escaped light paths.

    Arguments:
        position: [N, 3] exit points in metres.
        normal: [N, 3] unit normals on the side of `direction`: geometric as traced, zero where
            `bare`; interpolated over facets once settled on an exit surface.
        direction: [N, 3] unit directions.
        weight: [N, 3] path weights f/q in W per channel; their sum over `paths` is the flux.
        bare: [N] light that came straight from an emitter, without a scattering vertex.
        paths: number of emitted paths.
        dropped: paths left out because a value was not finite.
        cut: paths ended early because they were too long.
    """

    position: Float
    normal: Float
    direction: Float
    weight: Float
    bare: NDArray[np.bool_]
    paths: int
    dropped: int = 0
    cut: int = 0

    def __len__(self) -> int:
        return len(self.position)

    @cached_property
    def flux(self) -> NDArray[np.float64]:
        """Escaped power in W per channel, [3], summed in float64."""
        return self.weight.sum(0, dtype=np.float64) / self.paths

    @cached_property
    def flux_error(self) -> NDArray[np.float64]:
        """Standard error of `flux`, [3] in W."""
        second = np.square(self.weight, dtype=np.float64).sum(0) / self.paths
        return np.sqrt(np.maximum(second - self.flux**2, 0) / self.paths)

    @property
    def channels(self) -> tuple[bool, bool, bool]:
        """Which channels carry flux."""
        r, g, b = (bool(f > 0) for f in self.flux)
        return r, g, b

    def take(self, index: NDArray[np.int64] | slice) -> ExitRecords:
        """The records at `index`, with `paths` unchanged."""
        return ExitRecords(
            self.position[index], self.normal[index], self.direction[index],
            self.weight[index], self.bare[index], self.paths, self.dropped, self.cut,
        )  # fmt: skip

    @staticmethod
    def concatenate(parts: Sequence[ExitRecords]) -> ExitRecords:
        """Join the records of several batches."""
        return ExitRecords(
            np.concatenate([p.position for p in parts]),
            np.concatenate([p.normal for p in parts]),
            np.concatenate([p.direction for p in parts]),
            np.concatenate([p.weight for p in parts]),
            np.concatenate([p.bare for p in parts]),
            sum(p.paths for p in parts),
            sum(p.dropped for p in parts),
            sum(p.cut for p in parts),
        )


def settle(records: ExitRecords, surface: ExitSurface) -> tuple[ExitRecords, NDArray[np.int64]]:
    """Find each record's triangle by looking back at it from outside, as a viewer would.

    Normals become the surface's interpolated ones, the frame the teacher learns in.

    Light straight from an emitter takes its normal from there; if it meets no surface (a bare
    point source) it cannot be shown and is left out of the records, but stays in no flux either.

    Returns:
        the records kept, and their triangle [N], -1 where the view back meets another place
        (analytic shapes are tessellated).
    """
    reach = 3 * surface.sphere.radius
    hits = surface.intersect(records.position + reach * records.direction, -records.direction)
    distance = np.linalg.norm(hits.position - records.position[hits.index], axis=1)
    near = distance < 1e-2 * surface.sphere.radius
    triangle = np.full(len(records), -1, np.int64)
    triangle[hits.index[near]] = hits.triangle[near]
    normal = records.normal.copy()
    bare = records.bare[hits.index] & near
    normal[hits.index[bare]] = hits.normal[bare]
    normal = surface.shading_normals(records.position, normal, triangle)
    keep = np.flatnonzero(~records.bare | (triangle >= 0))
    settled = ExitRecords(
        records.position, normal, records.direction, records.weight, records.bare,
        records.paths, records.dropped, records.cut,
    )  # fmt: skip
    return settled.take(keep), triangle[keep]


def triangle_flux(records: ExitRecords, triangle: NDArray[np.int64], triangles: int) -> Float:
    """Power that leaves each triangle in W per channel: [triangles, 3]."""
    flux = np.zeros((triangles, 3))
    on = triangle >= 0
    np.add.at(flux, triangle[on], records.weight[on].astype(np.float64) / records.paths)
    return flux.astype(np.float32)


def escaped_part(records: ExitRecords, count: int) -> tuple[Float, Float]:
    """Directions and weights of the first `count` records, scaled to carry the whole flux."""
    part = records.take(slice(count))
    total = part.weight.sum(0, dtype=np.float64)
    scale = np.divide(records.flux, total, out=np.zeros(3), where=total > 0)
    return part.direction, (part.weight * scale).astype(np.float32)
