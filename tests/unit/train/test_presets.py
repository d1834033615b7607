"""Presets: the sizes that the paper states, and grids taken out of each other."""

from __future__ import annotations

import pytest
import torch

from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.networks.encodings import GridEncoding
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import ANCHORS, DRAFT, PAPER, PRESETS, GridSize, Preset

LAMP = Description(
    BoundingSphere((0.0, 0.0, 0.0), 1.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 1.0,
    (True, True, True), 1.0, 1, index=1.5,
)  # fmt: skip


@pytest.mark.parametrize(
    ("kinds", "megabytes"),
    [((Student,), 90), ((Transparency,), 73), ((Sampler, Sampler), 180), ((FastMap,), 93)],
)
def test_paper_has_the_sizes_of_the_paper(kinds: tuple[type, ...], megabytes: float) -> None:
    """Sec. 4.4, in single precision; a bundle holds the sampler's weights twice."""
    with torch.device("meta"):
        modules = [kind(LAMP, PAPER) for kind in kinds]
    numbers = sum(p.numel() for module in modules for p in module.parameters())
    assert 4e-6 * numbers == pytest.approx(megabytes, rel=0.1)


@pytest.mark.parametrize("preset", PRESETS.values(), ids=lambda preset: preset.name)
@pytest.mark.parametrize("anchor", ANCHORS)
def test_grids_of_anchors_are_taken_out_of_the_students(preset: Preset, anchor: str) -> None:
    sized = preset.for_route("photons", anchor=anchor)
    assert list(sized.anchors) == list(ANCHORS[anchor])
    grids = [sized.student_grid, *sized.anchors.values()]
    assert sum(map(_entries, grids)) <= 1.2 * _entries(preset.student_grid)


def test_presets_survive_json() -> None:
    preset = DRAFT.for_route("photons", anchor="both")
    assert Preset.from_dict(preset.to_dict()) == preset


def _entries(grid: GridSize) -> int:
    with torch.device("meta"):
        encoding = GridEncoding(grid.levels, grid.features, grid.base, grid.finest, grid.table_size)
    return encoding.table.numel()
