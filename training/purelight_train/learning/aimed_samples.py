"""Samples of caps that a pilot sampler has aimed: what sampler and fast map learn from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from purelight_train.learning.cap_samples import EVEN, CapSamples, cap_directions
from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Float, Radiance, look
from purelight_train.networks.fast_map import SIZE
from purelight_train.networks.sampler import Sampler

DRAWS = 64
CELLS = SIZE * SIZE
POINT_BATCH = 1 << 12


def aimed_samples(
    even: CapSamples,
    pilot: Sampler,
    description: Description,
    surface: ExitSurface,
    radiance: Radiance,
    rng: np.random.Generator,
    progress: Callable[[int], None] = lambda _: None,
) -> CapSamples:
    r"""The even samples and, for every point, as many as `DRAWS` that a pilot sampler draws.

    One even direction a cell rarely meets a filament, and then finds a hundred times the mean. All
    count by the balance heuristic (Veach 1995): with p the pilot's density on the cap's square,
    a sample's radiance becomes

    .. math:: \frac{L(z)}{64 + 64\,p(z)}

    Arguments:
        even: of the density one.
        pilot: learned from them.
    """
    draws = np.zeros((len(even.point), DRAWS, 2), np.float32)
    drawn = np.zeros((len(even.point), DRAWS, 3), np.float32)
    kept = np.zeros_like(even.radiance)
    for i in range(0, len(even.point), POINT_BATCH):
        part = slice(i, min(i + POINT_BATCH, len(even.point)))
        point = even.point[part]
        draws[part], density = _drawn(pilot, point, rng)
        direction = cap_directions(description, point, draws[part])
        seen = look(surface, radiance, np.repeat(point, DRAWS, 0), direction)
        drawn[part] = _share(seen.reshape(-1, DRAWS, 3), density)
        kept[part] = _share(EVEN * even.radiance[part], _density(pilot, point, even.square[part]))
        progress(part.stop)
    both = np.concatenate((even.square, draws), 1), np.concatenate((kept, drawn), 1)
    return CapSamples(even.point, *both)


def cell_means(samples: CapSamples) -> Float:
    """Estimates of the mean radiance in each cell of the cap: [P, 256, 3]."""
    column, row = np.minimum(samples.square * SIZE, SIZE - 1).astype(np.int64).transpose(2, 0, 1)
    cell = row * SIZE + column + CELLS * np.arange(len(samples.point))[:, None]
    means = [
        np.bincount(cell.ravel(), samples.radiance[..., c].ravel(), CELLS * len(samples.point))
        for c in range(3)
    ]
    return (CELLS * np.stack(means, -1)).reshape(-1, CELLS, 3).astype(np.float32)


def _share(radiance: Float, density: Float) -> Float:
    """What samples add to the integral over the square: [P, K, 3], [P, K] -> [P, K, 3]."""
    return (radiance / (EVEN + DRAWS * density[..., None])).astype(np.float32)


@torch.no_grad()
def _drawn(sampler: Sampler, point: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    """Places on the square that the sampler draws, [P, DRAWS, 2], and its density there."""
    device = next(sampler.parameters()).device
    context = sampler.encoding(torch.from_numpy(point).to(device))
    u = torch.from_numpy(rng.random((len(point) * DRAWS, 2)).astype(np.float32)).to(device)
    square = sampler.draw(u, context.repeat_interleave(DRAWS, 0))
    places = square.cpu().numpy().reshape(len(point), DRAWS, 2)
    return places, _density(sampler, point, places)


@torch.no_grad()
def _density(sampler: Sampler, point: Float, square: Float) -> Float:
    """The sampler's density on the square, its even part included: [P, 3], [P, K, 2] -> [P, K]."""
    device = next(sampler.parameters()).device
    context = sampler.encoding(torch.from_numpy(point).to(device))
    flat = torch.from_numpy(square.reshape(-1, 2)).to(device)
    log = sampler.learned_log_density(flat, context.repeat_interleave(square.shape[1], 0))
    density: Float = sampler.mixture(torch.exp(log)).cpu().numpy().reshape(square.shape[:2])
    return density
