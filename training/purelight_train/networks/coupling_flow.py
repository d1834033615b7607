r"""Normalizing flow on the unit square or cube with piecewise-quadratic couplings (Mueller 2019).

Each coupling warps one coordinate by a cumulative distribution whose density is piecewise linear,
with knots chosen by a network from the other coordinate and a context. The direction that is
evaluated for likelihoods, z -> u, is the CDF itself, so log-densities need no root finding.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.networks.encodings import MLP, one_blob

MIN_WIDTH = 1e-3
MIN_HEIGHT = 1e-3
BLOB_BINS = 16


class Spline:
    r"""One piecewise-quadratic CDF on [0, 1] per row.

    :math:`C(x) = c_b + w_b (v_b \alpha + \tfrac12 (v_{b+1} - v_b) \alpha^2)` with
    :math:`\alpha = (x - x_b)/w_b`; its density is :math:`v_b + \alpha (v_{b+1} - v_b)`.
    Widths and heights keep floors (`MIN_WIDTH`, `MIN_HEIGHT`) so that no bin degenerates.

    Arguments:
        logits: [N, 2K + 1], K width logits then K + 1 height logits.
    """

    def __init__(self, logits: Tensor) -> None:
        bins = (logits.shape[-1] - 1) // 2
        width = torch.softmax(logits[:, :bins], -1)
        self.width = MIN_WIDTH + (1 - bins * MIN_WIDTH) * width
        raw = logits[:, bins:]
        raw = torch.exp(raw - raw.max(-1, keepdim=True).values)
        area = (0.5 * (raw[:, 1:] + raw[:, :-1]) * self.width).sum(-1, keepdim=True)
        self.height = MIN_HEIGHT + (1 - MIN_HEIGHT) * raw / area
        zero = torch.zeros_like(self.width[:, :1])
        self.edge = torch.cat((zero, self.width.cumsum(-1)), -1)
        cell = 0.5 * (self.height[:, 1:] + self.height[:, :-1]) * self.width
        self.cdf = torch.cat((zero, cell.cumsum(-1)), -1)

    def _bin(self, x: Tensor, knots: Tensor) -> tuple[Tensor, ...]:
        """Start, width, CDF, left and right height of the bin that holds x; each [N]."""
        index = (x[:, None] >= knots[:, 1:-1]).sum(-1, keepdim=True)

        def pick(values: Tensor, shift: int = 0) -> Tensor:
            return values.gather(-1, index + shift)[:, 0]

        return (
            pick(self.edge), pick(self.width), pick(self.cdf),
            pick(self.height), pick(self.height, 1),
        )  # fmt: skip

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """CDF and density at x: [N] -> [N], [N]."""
        edge, width, cdf, left, right = self._bin(x, self.edge)
        a = ((x - edge) / width).clamp(0, 1)
        return (cdf + width * a * (left + 0.5 * a * (right - left))).clamp(0, 1), left + a * (
            right - left
        )

    def inverse(self, u: Tensor) -> tuple[Tensor, Tensor]:
        """Point whose CDF is u, and the density there: [N] -> [N], [N].

        The root is 2r / (v0 + sqrt(v0² + 2 (v1 - v0) r)), free of cancellation.
        """
        edge, width, cdf, left, right = self._bin(u, self.cdf)
        r = ((u - cdf) / width).clamp(min=0)
        slope = right - left
        root = torch.sqrt((left * left + 2 * slope * r).clamp(min=0))
        a = (2 * r / (left + root)).clamp(0, 1)
        return (edge + a * width).clamp(0, 1), left + a * slope


class Coupling(nn.Module):
    """Warp coordinate `dimension` given the `others` (how many there are) and the context."""

    def __init__(
        self, dimension: int, context: int, width: int, depth: int, bins: int, others: int = 1
    ) -> None:
        super().__init__()
        self.dimension = dimension
        self.network = MLP(context + others * BLOB_BINS, 2 * bins + 1, width, depth)
        last = self.network[-1]
        assert isinstance(last, nn.Linear)
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)

    def spline(self, coordinates: list[Tensor], context: Tensor) -> Spline:
        """The warp, from all coordinates [N] but its own."""
        others = [c for i, c in enumerate(coordinates) if i != self.dimension]
        encoded = [one_blob(other, BLOB_BINS) for other in others]
        return Spline(self.network(torch.cat((context, *encoded), -1)))


class CouplingFlow(nn.Module):
    """Conditional density on the unit square, or a cube of D dimensions, from couplings.

    Arguments:
        context: size of the context vector.
        couplings: number of coupling layers; layer i warps coordinate i mod D.
        width, depth: hidden layers of each coupling's network.
        bins: bins K of each spline.
        dimensions: D.
    """

    def __init__(
        self, context: int, couplings: int, width: int, depth: int, bins: int, dimensions: int = 2
    ) -> None:
        super().__init__()
        self.couplings = nn.ModuleList(
            Coupling(i % dimensions, context, width, depth, bins, dimensions - 1)
            for i in range(couplings)
        )

    @property
    def layers(self) -> list[Coupling]:
        return [layer for layer in self.couplings if isinstance(layer, Coupling)]

    def log_density(self, z: Tensor, context: Tensor) -> Tensor:
        """Log of the density at z with respect to area on the unit square.

        Arguments:
            z: [N, D] in the unit cube.
            context: [N, C].

        Returns:
            [N].
        """
        return self.to_uniform(z, context)[1]

    def to_uniform(self, z: Tensor, context: Tensor) -> tuple[Tensor, Tensor]:
        """Map z [N, D] to uniform u [N, D], and log |du/dz| [N]."""
        coordinates = list(z.unbind(-1))
        log_density = torch.zeros_like(coordinates[0])
        for layer in self.layers:
            d = layer.dimension
            spline = layer.spline(coordinates, context)
            coordinates[d], density = spline.forward(coordinates[d])
            log_density = log_density + torch.log(density)
        return torch.stack(coordinates, -1), log_density

    def sample(self, u: Tensor, context: Tensor) -> tuple[Tensor, Tensor]:
        """Map uniform u [N, D] to z [N, D], and the log-density at z [N]."""
        coordinates = list(u.unbind(-1))
        log_density = torch.zeros_like(coordinates[0])
        for layer in reversed(self.layers):
            d = layer.dimension
            spline = layer.spline(coordinates, context)
            coordinates[d], density = spline.inverse(coordinates[d])
            log_density = log_density + torch.log(density)
        return torch.stack(coordinates, -1), log_density
