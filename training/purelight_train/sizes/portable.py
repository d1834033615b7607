"""Sizes of the portable tier: the largest networks that every shading language affords.

What counts is what the exporter writes: a layer's products, and those that scale a grid's places.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks.tiers import PORTABLE
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.networks import student, transparency
from purelight_train.networks.encodings import GridEncoding
from purelight_train.presets import FlowSize, GridSize, MLPSize, Preset
from purelight_train.sizes.ladder import Rung, resized, student_rung, unit_points

# The best first: a second layer is worth more than a wider one.
NETWORKS = (MLPSize(32, 2), MLPSize(48, 1), MLPSize(32, 1), MLPSize(16, 2), MLPSize(16, 1))
SHARES = (1.0, 1 / 2, 1 / 4)
SAMPLER, FAST_MAP = FlowSize(2, MLPSize(16, 2), 16), MLPSize(32, 2)
OTHERS = 1 << 18  # Numbers of a network besides those of its grids, more than any here has.


def students(preset: Preset, surface: ExitSurface, rng: np.random.Generator) -> list[Rung]:
    """Students of the tier over grids of several resolutions, each with the best network that fits.

    Raises:
        PureLightError: If none fits.
    """
    unit = unit_points(surface, rng, preset.lift)
    found = {}
    for share in SHARES:
        sized = _bounded(resized(preset, share, unit))
        network = _best([sized.student_grid, *sized.anchors.values()], student.DEGREE)
        if network is not None:
            rung = student_rung(replace(sized, student_network=network))
            found[rung.weights] = rung
    if not found:
        raise PureLightError("the grids of this run have too many levels for the portable tier")
    return list(found.values())


def _bounded(preset: Preset) -> Preset:
    """The preset with the student's tables as small as the tier wants them."""
    room = (PORTABLE.constants - OTHERS) // (1 + len(preset.anchors))
    anchor = preset.anchor_grid
    return replace(
        preset, student_grid=_table_within(preset.student_grid, room),
        anchor_grid=None if anchor is None else _table_within(anchor, room),
    )  # fmt: skip


def _table_within(grid: GridSize, room: int) -> GridSize:
    while _entries(grid) * grid.features > room:
        grid = replace(grid, table_size=grid.table_size // 2)
    return grid


def transparencies(preset: Preset) -> Iterator[Preset]:
    """The preset with transparencies of the tier, the largest first."""
    room = (PORTABLE.constants - OTHERS) // len(preset.transparency_grids)
    grid = _table_within(preset.transparency_grid, room)
    while True:
        sized = replace(preset, transparency_grid=grid)
        network = _best(sized.transparency_grids, transparency.DEGREE)
        if network is not None:
            yield replace(sized, transparency_network=network)
        if grid.levels <= 2:
            return
        grid = replace(grid, levels=grid.levels - 1, finest=_finest(grid, grid.levels - 1))


def sampling(preset: Preset) -> Preset:
    """The preset with a sampler and a fast map of the tier."""
    return replace(preset, sampler_flow=SAMPLER, fast_map_network=FAST_MAP, fast_map_one_hot=False)


def fits(grids: Sequence[GridSize], network: MLPSize, degree: int) -> bool:
    """Whether a network on the surface is of the tier."""
    if network.width % PORTABLE.multiple:
        return False
    numbers = sum(_entries(grid) * grid.features for grid in grids)
    return (
        surface_macs(grids, network, degree) <= PORTABLE.macs
        and numbers + OTHERS <= PORTABLE.constants
    )


def surface_macs(grids: Sequence[GridSize], network: MLPSize, degree: int) -> int:
    """Multiply-adds of a student as it is exported; a transparency has no tilt and takes less."""
    harmonics = degree**2 - 1  # The constant ones are in the bias.
    inputs = sum(grid.levels * grid.features for grid in grids) + 2 * harmonics
    layers = inputs * network.width + (network.depth - 1) * network.width**2 + 3 * network.width
    return layers + 3 * harmonics + sum(9 * grid.levels * (1 + grid.features) for grid in grids)


def _best(grids: Sequence[GridSize], degree: int) -> MLPSize | None:
    """The best network that fits these grids."""
    return next((network for network in NETWORKS if fits(grids, network, degree)), None)


def _entries(grid: GridSize) -> int:
    """Rows of a grid's tables."""
    return sum(min((r + 1) ** 3, grid.table_size) for r in _resolutions(grid))


def _finest(grid: GridSize, levels: int) -> int:
    return _resolutions(grid)[levels - 1]


def _resolutions(grid: GridSize) -> list[int]:
    return GridEncoding(grid.levels, 1, grid.base, grid.finest, 2).resolutions
