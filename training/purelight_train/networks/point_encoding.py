"""Encoding of a shading point for the sampler and the fast map."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from purelight_format.measures import BoundingSphere, encode_point
from purelight_train.light.description import Description
from purelight_train.networks.encodings import one_blob
from purelight_train.networks.surface_network import make_grid
from purelight_train.presets import GridSize

ANGLE_BINS = 16


class PointEncoding(nn.Module):
    """Features of `encode_point`: a dense grid of the place, one-blob of the cap's half-angle.

    [N, 3] -> [N, size]. The sphere's centre is the one that a graph in float32 has.
    """

    def __init__(self, description: Description, grid: GridSize) -> None:
        super().__init__()
        x, y, z = np.array(description.sphere.center, np.float32).tolist()
        self.sphere = BoundingSphere((x, y, z), description.sphere.radius)
        self.r_max = description.r_max
        self.grid = make_grid(grid)

    @property
    def size(self) -> int:
        return self.grid.size + ANGLE_BINS

    def forward(self, point: Tensor) -> Tensor:
        place, angle = encode_point(point, self.sphere, self.r_max)
        return torch.cat((self.grid(place), one_blob(angle, ANGLE_BINS)), dim=-1)
