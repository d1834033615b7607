"""Rays to compare photons with: drawn where the light is, by a density that is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from purelight_format.geometry import disk_to_square, frame, square_to_disk
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]
Index = NDArray[np.int64]
UNIFORM_SHARE = 0.5
RECORDS, FINEST = 4.0, 16  # records a cell on average, and cells across the hemisphere at most


@dataclass(frozen=True)
class ReferenceRays:
    r"""Rays that leave an exit surface, half of them uniform and half drawn as light was traced.

    Uniform is by area and projected solid angle. The light is a histogram over the sides of the
    triangles and k x k equal cells of the projected hemisphere's square, so that with u the uniform
    density, and P and U the light and the measure of a cell,

    .. math:: \rho = q / u = \tfrac12 + \tfrac12\,P / U

    is known of every ray, and :math:`E_u[f] = E_q[f / \rho]`. Light that leaves glass in narrow
    beams is rarely met by uniform rays: their few large values would make most of the noise of a
    loss, and clipped gradients a bias of it.

    Arguments:
        light: part of the light in each cell, [2 T, k k]; the backs of the triangles come last.
    """

    surface: ExitSurface
    light: NDArray[np.float64]

    @staticmethod
    def of(surface: ExitSurface, records: ExitRecords, triangle: Index) -> ReferenceRays:
        """From light as a viewer meets it, and the triangle of each record (`settle`)."""
        sides = 2 * len(surface.triangles)
        across = int(np.clip(np.sqrt(len(records) / (RECORDS * sides)), 1, FINEST))
        empty = ReferenceRays(surface, np.zeros((sides, across**2)))
        cell = empty.cells(triangle, records.normal, records.direction)
        light = np.bincount(cell, records.weight.sum(1), minlength=empty.light.size)
        light = light.reshape(sides, -1) * (empty._sides > 0)[:, None]
        return ReferenceRays(surface, light / light.sum())

    @property
    def across(self) -> int:
        """Cells along each axis of the hemisphere's square."""
        return round(self.light.shape[1] ** 0.5)

    @cached_property
    def _sides(self) -> NDArray[np.float64]:
        """Measure of each side of a triangle, as part of all: [2 T]."""
        part, both = self.surface.triangle_area / self.surface.area, self.surface.two_sided
        return np.concatenate([np.where(both, part / 2, part), np.where(both, part / 2, 0)])

    @cached_property
    def _chance(self) -> NDArray[np.float64]:
        """Of each cell: [2 T k k]."""
        even = np.repeat(self._sides / self.across**2, self.across**2)
        return UNIFORM_SHARE * even + (1 - UNIFORM_SHARE) * self.light.reshape(-1)

    @cached_property
    def _log_ratio(self) -> Float:
        """Log of rho in each cell, zero where no ray begins: [2 T k k]."""
        even = np.repeat(self._sides / self.across**2, self.across**2)
        ratio = np.divide(self._chance, even, out=np.ones_like(even), where=even > 0)
        return np.log(ratio).astype(np.float32)

    def cells(self, triangle: Index, normal: Float, outgoing: Float) -> Index:
        """The cell of rays, from their triangles [N] and two of [N, 3]: [N]."""
        back = np.einsum("nd,nd->n", normal, self.surface.outward_normals()[triangle]) < 0
        tangent, bitangent = frame(normal)
        disk = np.stack([(t * outgoing).sum(1) for t in (tangent, bitangent)], 1)
        square = disk_to_square(disk.astype(np.float64))
        column, row = np.minimum(square * self.across, self.across - 1).astype(np.int64).T
        side = triangle + back * len(self.surface.triangles)
        return (side * self.across + row) * self.across + column

    def log_ratio(self, triangle: Index, normal: Float, outgoing: Float) -> Float:
        """Log of rho of rays, arguments as for `cells`: [N]."""
        return self._log_ratio[self.cells(triangle, normal, outgoing)]

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Float, Float, Float, Float]:
        """Position, normal, outgoing direction, each [count, 3], and log of rho, [count].

        Cells take turns in proportion to their chance, in random order.
        """
        cumulative = np.cumsum(self._chance)
        turn = (np.arange(count) + rng.random(count)) * (cumulative[-1] / count)
        cell = np.minimum(np.searchsorted(cumulative, turn, "right"), len(cumulative) - 1)
        rng.shuffle(cell)
        side, within = np.divmod(cell, self.across**2)
        back, triangle = np.divmod(side, len(self.surface.triangles))
        position = self.surface.points_of(triangle, rng.random((2, count)))
        normal = self.surface.outward_normals()[triangle] * np.where(back, -1, 1)[:, None]
        row, column = np.divmod(within, self.across)
        square = (np.stack((column, row), 1) + rng.random((count, 2))) / self.across
        outgoing = _from_hemisphere(square, normal)
        return position, normal.astype(np.float32), outgoing, self._log_ratio[cell]


def _from_hemisphere(square: NDArray[np.float64], normal: NDArray[np.float64]) -> Float:
    """Unit directions about normals, from the projected hemisphere's square: [N, 2] -> [N, 3]."""
    disk, (tangent, bitangent) = square_to_disk(square), frame(normal)
    up = np.sqrt(np.maximum(1 - (disk**2).sum(1, keepdims=True), 1e-12))
    direction = disk[:, :1] * tangent + disk[:, 1:] * bitangent + up * normal
    return direction.astype(np.float32)
