"""A network over (position, normal, outgoing) on the exit surface."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import torch
from torch import Tensor, nn

from purelight_format.namespace import A, namespace
from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP, GridEncoding, SphericalHarmonics
from purelight_train.presets import GridSize, MLPSize


def make_grid(size: GridSize) -> GridEncoding:
    """A grid encoding of the given size."""
    return GridEncoding(size.levels, size.features, size.base, size.finest, size.table_size)


class SurfaceNetwork(nn.Module):
    r"""Grid-encoded position, harmonics of outgoing and normal, then an MLP: [N, 3] outputs.

    The grid looks up the point x + lift R n, normalised by the cube around the sphere of all such
    points, (x - c + lift R n) / 2R(1 + lift) + 1/2: at x itself the bright inside of a thin shade
    and its dark outside would be one place, of which a small MLP has to make two by the normal
    alone. Anchors are normalised by the cube around the bounding sphere. The MLP's input is
    [grid(position), grids(anchors), harmonics(outgoing), harmonics(normal)]. An anchor is the point
    of a ray nearest the sphere's centre, so that all points along the ray have the same:

    - `straight`, of the ray outside: what one sees through walls of clear glass is nearly a
      function of it;
    - `refracted`, of the ray inside the glass, before it left: what one sees in solid cut glass
      is. Its direction, along -outgoing back into an index :math:`\eta`, is
      :math:`t + n \sqrt{1 - |t|^2}` with :math:`t = (\omega - (\omega \cdot n) n) / \eta`.
    """

    centre: Tensor

    def __init__(
        self,
        description: Description,
        grid: GridSize,
        degree: int,
        network: MLPSize,
        anchors: Mapping[str, GridSize] = MappingProxyType({}),
        lift: float = 0.0,
    ) -> None:
        super().__init__()
        sphere = description.sphere
        self.register_buffer("centre", torch.tensor(sphere.center), persistent=False)
        self.radius, self.index, self.lift = sphere.radius, description.index, lift
        self.grid = make_grid(grid)
        self.anchors = nn.ModuleDict({kind: make_grid(size) for kind, size in anchors.items()})
        self.harmonics = SphericalHarmonics(degree)
        grids: list[Any] = [self.grid, *self.anchors.values()]
        inputs = sum(part.size for part in grids) + 2 * self.harmonics.size
        self.network = MLP(inputs, 3, network.width, network.depth)

    def features(
        self, position: Tensor, normal: Tensor, outgoing: Tensor, encoded: Tensor
    ) -> Tensor:
        """Encoded inputs [N, inputs] of the MLP; `encoded` is the normal that it is told.

        The told one lifts the point too: where it is shaken, points near a crease are close.
        """
        offset = (position - self.centre) * (0.5 / self.radius)
        parts = [self.grid(lifted(offset, encoded, self.lift) + 0.5)]
        for kind, grid in self.anchors.items():
            ray = outgoing if kind == "straight" else refracted(normal, outgoing, self.index)
            along = (offset * ray).sum(-1, keepdim=True)
            parts.append(grid(offset - along * ray + 0.5))
        return torch.cat((*parts, self.harmonics(outgoing), self.harmonics(encoded)), dim=-1)

    def raw(
        self, position: Tensor, normal: Tensor, outgoing: Tensor, encoded: Tensor | None = None
    ) -> Tensor:
        """The MLP's outputs before the last activation: [N, 3].

        Arguments:
            encoded: [N, 3] normals to encode in place of `normal`.
        """
        told = normal if encoded is None else encoded
        output: Tensor = self.network(self.features(position, normal, outgoing, told))
        return output


def lifted(offset: A, normal: A, lift: float) -> A:
    """Where a grid looks points up, in its cube: two of [N, 3] -> [N, 3].

    Arguments:
        offset: (x - c) / 2R; tensors, arrays or values of a graph, as the unit normals.
        lift: in radii R.
    """
    if not lift:
        return offset
    raised: A = (offset + normal * (0.5 * lift)) * (1 / (1 + lift))
    return raised


def refracted(normal: A, outgoing: A, index: float) -> A:
    """Directions inside glass of light that leaves it, by Snell's law: two of [N, 3] -> [N, 3].

    Tensors or values of a graph, as in `purelight_format.measures`.
    """
    xp = namespace(normal)
    tangential = (outgoing - xp.column(xp.sum(outgoing * normal)) * normal) * (1 / index)
    cosine = xp.sqrt(xp.relu(1.0 - xp.column(xp.sum(tangential * tangential))))
    inside: A = tangential + normal * cosine
    return inside
