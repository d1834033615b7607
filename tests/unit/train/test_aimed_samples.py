"""Estimates of a map's cells: without bias, whatever the sampler has learned."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
import trimesh

from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.networks.sampler import Sampler
from purelight_train.presets import DRAFT

pytest.importorskip("mitsuba")

LAMP = Description(
    BoundingSphere((0.0, 0.0, 0.0), 1.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0), 1.0,
    (True, True, False), 1.0, 1,
)  # fmt: skip
REPEATS = 96


def spot(position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray) -> np.ndarray:
    """A small bright spot on a dim ball, as seen from anywhere."""
    bright = (position @ np.array([0.6, 0, 0.8], np.float32)) > 0.997
    return np.where(bright[:, None], [50.0, 20.0, 0.0], [0.5, 1.0, 0.0]).astype(np.float32)


def even_samples(surface: Any, rng: np.random.Generator) -> Any:
    """One direction in each cell, from the same point every time."""
    from purelight_train.learning.cap_samples import EVEN, SIDE, CapSamples, cap_directions
    from purelight_train.light.radiance_field import look

    point = np.tile(np.array([[2.0, 0.5, 3.0]], np.float32), (32, 1))
    row, column = np.divmod(np.arange(EVEN), SIDE)
    square = (np.stack((column, row), 1) + rng.random((32, EVEN, 2))) / SIDE
    direction = cap_directions(LAMP, point, square.astype(np.float32))
    seen = look(surface, spot, np.repeat(point, EVEN, 0), direction)
    return CapSamples(point, square.astype(np.float32), seen.reshape(32, EVEN, 3) / EVEN)


def test_maps_have_no_bias(mitsuba: Any) -> None:
    """Sums and quarters of maps are those of even samples; an unlearned sampler is not even."""
    from purelight_train.learning.aimed_samples import aimed_samples, cell_means
    from purelight_train.light.exit_surface import ExitSurface

    mesh = trimesh.creation.icosphere(subdivisions=3)
    surface = ExitSurface(
        mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32),
        np.zeros(len(mesh.faces), bool),
    )  # fmt: skip
    torch.manual_seed(0)
    sampler = Sampler(LAMP, DRAFT)
    with torch.no_grad():  # Far from even
        for parameter in sampler.parameters():
            parameter.add_(0.3 * torch.randn_like(parameter))
    even, ours = [], []
    for seed in range(REPEATS):
        rng = np.random.default_rng([7, seed])
        samples = even_samples(surface, rng)
        aimed = aimed_samples(samples, sampler, LAMP, surface, spot, rng)
        even.append(cell_means(samples))
        ours.append(cell_means(aimed))
    for cells in (slice(None), slice(0, 64), slice(64, 128), slice(128, 192), slice(192, 256)):
        a, b = (np.concatenate(v)[:, cells, :2].mean((1, 2)) for v in (even, ours))
        error = np.sqrt((a.var() + b.var()) / len(a))
        assert abs(a.mean() - b.mean()) < 4.5 * error + 1e-9
    assert (np.concatenate(ours)[..., 2] == 0).all()
