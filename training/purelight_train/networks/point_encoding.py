"""Encoding of a shading point for the sampler and the fast map."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.networks.encodings import one_blob
from purelight_train.networks.surface_network import make_grid
from purelight_train.presets import GridSize

ANGLE_BINS = 16


class PointEncoding(nn.Module):
    r"""Dense-grid features of the point and one-blob of the cap's half-angle: [N, 3] -> [N, size].

    The grid coordinate is :math:`\tfrac12 + \tfrac12 e\,s` with the unit direction e from the
    centre to the point and :math:`s = \tfrac12 + \tfrac12 \ln(d/R) / \ln r_{max}`: logarithmic in
    distance, so that directions stay resolved near the lamp. Distances are clipped to
    [R, r_max R]; farther points use the field of r_max.
    """

    centre: Tensor

    def __init__(self, description: Description, grid: GridSize) -> None:
        super().__init__()
        self.register_buffer("centre", torch.tensor(description.sphere.center), persistent=False)
        self.radius, self.r_max = description.sphere.radius, description.r_max
        self.grid = make_grid(grid)

    @property
    def size(self) -> int:
        return self.grid.size + ANGLE_BINS

    def forward(self, point: Tensor) -> Tensor:
        offset = point - self.centre
        distance = offset.norm(dim=-1).clamp(min=1e-30)
        ratio = (distance / self.radius).clamp(1, self.r_max)
        s = 0.5 + 0.5 * torch.log(ratio) / math.log(self.r_max)
        grid = self.grid(0.5 + 0.5 * offset * (s / distance)[:, None])
        angle = torch.asin(1 / ratio) * (2 / math.pi)
        return torch.cat((grid, one_blob(angle, ANGLE_BINS)), dim=-1)
