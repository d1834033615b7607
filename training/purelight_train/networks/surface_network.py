"""A network over (position, normal, outgoing) on the exit surface."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP, GridEncoding, SphericalHarmonics
from purelight_train.presets import GridSize, MLPSize


def make_grid(size: GridSize) -> GridEncoding:
    """A grid encoding of the given size."""
    return GridEncoding(size.levels, size.features, size.base, size.finest, size.table_size)


class SurfaceNetwork(nn.Module):
    """Grid-encoded position, harmonics of outgoing and normal, then an MLP: [N, 3] outputs.

    Positions are normalised by the cube around the bounding sphere, (x - c)/2R + 1/2. The MLP's
    input is [grid(position), grid(anchor), harmonics(outgoing), harmonics(normal)], the second
    only with an anchor grid. The anchor is the point of the ray nearest the sphere's centre: all
    points along a ray have the same, and what one sees through clear glass is nearly a function of
    the ray.
    """

    centre: Tensor

    def __init__(
        self,
        description: Description,
        grid: GridSize,
        degree: int,
        network: MLPSize,
        anchor: GridSize | None = None,
    ) -> None:
        super().__init__()
        sphere = description.sphere
        self.register_buffer("centre", torch.tensor(sphere.center), persistent=False)
        self.radius = sphere.radius
        self.grid = make_grid(grid)
        self.anchor = None if anchor is None else make_grid(anchor)
        self.harmonics = SphericalHarmonics(degree)
        anchors = 0 if self.anchor is None else self.anchor.size
        inputs = self.grid.size + anchors + 2 * self.harmonics.size
        self.network = MLP(inputs, 3, network.width, network.depth)

    def features(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """Encoded inputs [N, inputs] of the MLP."""
        offset = (position - self.centre) * (0.5 / self.radius)
        parts = [self.grid(offset + 0.5)]
        if self.anchor is not None:
            along = (offset * outgoing).sum(-1, keepdim=True)
            parts.append(self.anchor(offset - along * outgoing + 0.5))
        return torch.cat((*parts, self.harmonics(outgoing), self.harmonics(normal)), dim=-1)

    def raw(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """The MLP's outputs before the last activation: [N, 3]."""
        output: Tensor = self.network(self.features(position, normal, outgoing))
        return output
