"""Sizes of student and transparency from small to large, each no larger than the lamp can use."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_surface import ExitSurface
from purelight_train.networks.encodings import GridEncoding
from purelight_train.networks.student import DEGREE
from purelight_train.networks.surface_network import lifted
from purelight_train.presets import GridSize, MLPSize, Preset

SHARES = (1 / 8, 1 / 4, 3 / 8, 1 / 2, 3 / 4, 1.0)
SURFACE_SAMPLES = 1 << 18
Unit = NDArray[np.float64]
CORNERS = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)])


@dataclass(frozen=True)
class Rung:
    """One size.

    Arguments:
        preset: with this student.
        weights: numbers the student holds.
        macs: multiply-adds of its layers per sample.
    """

    preset: Preset
    weights: int
    macs: int


def ladder(preset: Preset, surface: ExitSurface, rng: np.random.Generator) -> list[Rung]:
    """Students of growing width and resolution, up to that of the preset, with the link `log`.

    Grids over anchors keep the preset's share of their tables.
    """
    unit = unit_points(surface, rng, preset.lift)
    rungs = [_rung(preset, share, unit) for share in SHARES]
    return sorted(set(rungs), key=lambda rung: (rung.macs, rung.weights))


def unit_points(surface: ExitSurface, rng: np.random.Generator, lift: float = 0.0) -> Unit:
    """Points of the surface in the unit cube of a grid that lifts them: [N, 3]."""
    position, normal = surface.sample(SURFACE_SAMPLES, rng)
    sphere = surface.sphere
    offset = (position - np.asarray(sphere.center)) * (0.5 / sphere.radius)
    return lifted(offset, normal, lift) + 0.5


def part_of(grid: GridSize, network: MLPSize, share: float, unit: Unit) -> tuple[GridSize, MLPSize]:
    """A share of the size of a network on the surface.

    Its grid gets a table that holds the vertices the surface touches at the finest level, and no
    more.
    """
    coarse = _coarser(grid, share)
    table_size = min(coarse.table_size, _power_of_two(touched(unit, coarse.finest)))
    width = max(8, 8 * round(network.width * share / 8))
    depth = network.depth if share > 0.5 else max(1, network.depth - 1)
    return replace(coarse, table_size=table_size), MLPSize(width, depth)


def touched(unit: Unit, resolution: int) -> int:
    """Vertices of a grid over the unit cube that interpolate some of the points [N, 3]."""
    stride = np.int64(resolution + 1) ** np.arange(3)
    low = np.minimum(np.floor(unit * resolution), resolution - 1).astype(np.int64) @ stride
    return len(np.unique(np.unique(low)[:, None] + CORNERS @ stride))


def _rung(preset: Preset, share: float, unit: Unit) -> Rung:
    grid, network = part_of(preset.student_grid, preset.student_network, share, unit)
    return student_rung(replace(_with_grid(preset, share, grid), student_network=network))


def resized(preset: Preset, share: float, unit: Unit) -> Preset:
    """The preset with a share of the resolution of the student's grids, and the link `log`."""
    grid, _ = part_of(preset.student_grid, preset.student_network, share, unit)
    return _with_grid(preset, share, grid)


def _with_grid(preset: Preset, share: float, grid: GridSize) -> Preset:
    """The preset with this grid, a share of the others' resolution, and the link `log`."""
    anchor = None if preset.anchor_grid is None else _coarser(preset.anchor_grid, share)
    return replace(preset, student_grid=grid, anchor_grid=anchor, student_link="log")


def student_rung(sized: Preset) -> Rung:
    """The size of a preset's student."""
    width, depth = sized.student_network.width, sized.student_network.depth
    grids = [sized.student_grid, *sized.anchors.values()]
    inputs = 2 * DEGREE**2 + sum(g.levels * g.features for g in grids)
    macs = inputs * width + (depth - 1) * width**2 + 3 * width
    tables = sum(map(_entries, grids))
    return Rung(sized, tables + macs + depth * width + 3, macs)


def _coarser(grid: GridSize, share: float) -> GridSize:
    """The grid's levels up to a share of its finest resolution, at least two."""
    encoding = GridEncoding(grid.levels, 1, grid.base, grid.finest, 2)
    kept = max(2, sum(r <= share * grid.finest for r in encoding.resolutions))
    table = grid.table_size if share == 1 else max(1 << 10, _power_of_two(grid.table_size * share))
    finest = encoding.resolutions[kept - 1]
    return replace(grid, levels=kept, finest=finest, table_size=table)


def _entries(grid: GridSize) -> int:
    encoding = GridEncoding(grid.levels, 1, grid.base, grid.finest, grid.table_size)
    return encoding.table.numel() * grid.features


def _power_of_two(count: float) -> int:
    return 1 << max(0, int(np.ceil(np.log2(max(count, 1)))))
