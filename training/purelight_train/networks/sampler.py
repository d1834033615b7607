"""Sampler (paper Sec. 3.4): directions towards the lamp, as a flow on its spherical cap."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_format.measures import Cap, cap, cap_to_direction, direction_to_cap
from purelight_train.light.description import Description
from purelight_train.networks.coupling_flow import CouplingFlow
from purelight_train.networks.point_encoding import PointEncoding
from purelight_train.presets import Preset

UNIFORM_FRACTION = 0.05


class Sampler(nn.Module):
    r"""Defensive mixture :math:`p = (1-b)\,p_{flow} + b` on the square of the cap.

    b bounds every weight: no direction in the cap is drawn b times less often than uniformly.
    Points inside the bounding sphere see no cap; their pdf is zero.
    """

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        self.encoding = PointEncoding(description, preset.point_grid)
        size = preset.sampler_flow
        self.flow = CouplingFlow(
            self.encoding.size, size.couplings, size.network.width, size.network.depth, size.bins
        )
        self.uniform_fraction = UNIFORM_FRACTION

    def log_density(self, z: Tensor, point: Tensor) -> Tensor:
        """Log of the flow's density on the cap's square, without the mixture: [N, 2] -> [N]."""
        return self.learned_log_density(z, self.encoding(point))

    def learned_log_density(self, z: Tensor, context: Tensor) -> Tensor:
        """`log_density` in terms of the encoded point."""
        return self.flow.log_density(z, context)

    def warp(self, u: Tensor, context: Tensor) -> Tensor:
        """Uniforms [N, 2] warped to the learned density on the square [N, 2]."""
        return self.flow.sample(u, context)[0]

    def mixture(self, density: Tensor) -> Tensor:
        """Density on the square from the flow's."""
        return (1 - self.uniform_fraction) * density + self.uniform_fraction

    def draw(self, u: Tensor, context: Tensor) -> Tensor:
        """Uniforms [N, 2] to the square by the mixture: [N, 2]."""
        b = self.uniform_fraction
        uniform = u[:, 0] < b
        first = torch.where(uniform, u[:, 0] / b, (u[:, 0] - b) / (1 - b))
        start = torch.stack((first.clamp(0, 1), u[:, 1]), -1)
        return torch.where(uniform[:, None], start, self.warp(start, context))

    def _pdf(self, density: Tensor, view: Cap[Tensor], inside: Tensor) -> Tensor:
        return torch.where(inside, self.mixture(density) / view.solid_angle, 0.0)

    def forward(self, point: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Sample directions: points [N, 3], uniforms [N, 2] -> toward [N, 3], pdf [N] per sr."""
        context = self.encoding(point)
        z = self.draw(u, context)
        density = torch.exp(self.learned_log_density(z, context))
        view = cap(point, self.encoding.sphere)
        toward = torch.where(view.outside[:, None], cap_to_direction(z, view), view.axis)
        return toward, self._pdf(density, view, view.outside)

    def pdf_solid_angle(self, point: Tensor, toward: Tensor) -> Tensor:
        """Density of `forward` per solid angle, zero outside the cap: [N, 3], [N, 3] -> [N]."""
        view = cap(point, self.encoding.sphere)
        z, inside = direction_to_cap(toward, view)
        density = torch.exp(self.log_density(z, point))
        return self._pdf(density, view, view.outside & inside)
