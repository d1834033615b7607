"""What the fast map learns: mean radiance in the cells of caps, from two kinds of samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from purelight_train.learning.cap_samples import CELLS, CapSamples, Radiance, cap_directions, look
from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.networks.fast_map import SIZE
from purelight_train.networks.sampler import Sampler

Float = NDArray[np.float32]
DRAWS = 128
MOST = 1 << 16  # points
POINT_BATCH = 1 << 10


@dataclass(frozen=True)
class MapSamples:
    r"""Estimates of the mean radiance in each cell of the cap, from shading points.

    One even direction a cell rarely meets a filament, and then finds a hundred times the mean. So
    directions that the trained sampler draws are added, and all are weighed by the balance
    heuristic (Veach 1995): with p the sampler's density on the cap's square,

    .. math:: L_k = \sum_{z \in k} \frac{256\,L(z)}{256 + 128\,p(z)}

    over the samples z in cell k of both kinds.

    Arguments:
        point: [P, 3].
        radiance: L of each cell, [P, 256, 3].
    """

    point: Float
    radiance: Float

    @staticmethod
    def of(
        even: CapSamples,
        sampler: Sampler,
        description: Description,
        surface: ExitSurface,
        radiance: Radiance,
        rng: np.random.Generator,
        progress: Callable[[int], None] = lambda _: None,
    ) -> MapSamples:
        """From even samples, one in each cell, and a sampler that learned from them.

        Points beyond `MOST` are left out.
        """
        count = min(len(even.point), MOST)
        value = np.zeros_like(even.radiance[:count])
        for i in range(0, count, POINT_BATCH):
            part = slice(i, min(i + POINT_BATCH, count))
            point = even.point[part]
            square, density = _drawn(sampler, point, rng)
            direction = cap_directions(description, point, square)
            seen = look(surface, radiance, np.repeat(point, DRAWS, 0), direction)
            value[part] = _share(even.radiance[part], _density(sampler, point, even.square[part]))
            drawn = _share(seen.reshape(-1, DRAWS, 3), density)
            column, row = np.minimum(square * SIZE, SIZE - 1).astype(np.int64).transpose(2, 0, 1)
            where = np.arange(len(point))[:, None], row * SIZE + column
            np.add.at(value[part], where, drawn)
            progress(part.stop)
        return MapSamples(even.point[:count], value)


def _share(radiance: Float, density: Float) -> Float:
    """What samples add to the mean of their cell: [P, K, 3], [P, K] -> [P, K, 3]."""
    weight = CELLS / (CELLS + DRAWS * density)
    return (radiance * weight[..., None]).astype(np.float32)


@torch.no_grad()
def _drawn(sampler: Sampler, point: Float, rng: np.random.Generator) -> tuple[Float, Float]:
    """Places on the square that the sampler draws, [P, DRAWS, 2], and its density there."""
    device = sampler.encoding.centre.device
    context = sampler.encoding(torch.from_numpy(point).to(device))
    u = torch.from_numpy(rng.random((len(point) * DRAWS, 2)).astype(np.float32)).to(device)
    square = sampler.draw(u, context.repeat_interleave(DRAWS, 0))
    places = square.cpu().numpy().reshape(len(point), DRAWS, 2)
    return places, _density(sampler, point, places)


@torch.no_grad()
def _density(sampler: Sampler, point: Float, square: Float) -> Float:
    """The sampler's density on the square, its even part included: [P, 3], [P, K, 2] -> [P, K]."""
    device = sampler.encoding.centre.device
    context = sampler.encoding(torch.from_numpy(point).to(device))
    flat = torch.from_numpy(square.reshape(-1, 2)).to(device)
    log = sampler.learned_log_density(flat, context.repeat_interleave(square.shape[1], 0))
    density: Float = sampler.mixture(torch.exp(log)).cpu().numpy().reshape(square.shape[:2])
    return density
