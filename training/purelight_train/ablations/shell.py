"""Appearance on the bounding sphere instead of the exit surface (paper Sec. 4.5, `Shell 4D`).

Radiance does not change along a ray, so the light that leaves the lamp at x along w is that which
leaves the sphere where the ray crosses it. Its density is learned there by flows alone: in four
dimensions at once, or as a marginal of the place times a conditional of the direction.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.light.ray_chart import direction_to_square
from purelight_train.networks.coupling_flow import CouplingFlow
from purelight_train.networks.surface_network import make_grid
from purelight_train.presets import GridSize, Preset

Float = NDArray[np.float32]
EVALUATED = 1 << 15
SHELL_GRID = GridSize(4, 4, 8, 32, 1 << 16)  # dense: 33^3 vertices fit


class Shell(nn.Module):
    """Density of light over (place on the sphere, projected direction), per channel."""

    centre: Tensor

    def __init__(self, description: Description) -> None:
        super().__init__()
        sphere = description.sphere
        self.register_buffer("centre", torch.tensor(sphere.center), persistent=False)
        self.radius = sphere.radius

    def crossing(self, position: Tensor, outgoing: Tensor) -> Tensor:
        """Unit normal where the ray leaves the sphere: [N, 3], [N, 3] -> [N, 3]."""
        offset = (position - self.centre) / self.radius
        along = (offset * outgoing).sum(-1)
        outside = ((offset * offset).sum(-1) - along**2).clamp(max=1)
        ahead = torch.sqrt(1 - outside) - along
        return nn.functional.normalize(offset + ahead[:, None] * outgoing, dim=-1)

    def log_square(self, place: Tensor, square: Tensor, normal: Tensor, channel: Tensor) -> Tensor:
        """Log-density over both unit squares, of the place and of the direction: [N].

        Arguments:
            place, square: [N, 2].
            normal: [N, 3] unit vector to the place.
            channel: [N, 3], one-hot.
        """
        raise NotImplementedError

    def log_pdf(self, position: Tensor, outgoing: Tensor, channel: Tensor) -> Tensor:
        """Log-density per area of the sphere and projected solid angle, channel index [N]: [N]."""
        normal = self.crossing(position, outgoing)
        one_hot = nn.functional.one_hot(channel, 3).to(position.dtype)
        place, square = equal_area(normal), direction_to_square(outgoing, normal)
        measure = 4 * math.pi**2 * self.radius**2
        return self.log_square(place, square, normal, one_hot) - math.log(measure)


class Shell4D(Shell):
    """One flow over all four dimensions."""

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(description)
        size = preset.teacher_flow
        self.flow = CouplingFlow(
            3, 2 * size.couplings, size.network.width, size.network.depth, size.bins, dimensions=4
        )

    def log_square(self, place: Tensor, square: Tensor, normal: Tensor, channel: Tensor) -> Tensor:
        return self.flow.log_density(torch.cat((place, square), -1), channel)


class ShellFactorised(Shell):
    """A flow for the place, and one for the direction given a dense grid over the sphere.

    The paper's grid is over two coordinates of the sphere; ours is over its points in space, which
    has no seam.
    """

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(description)
        size = preset.teacher_flow
        own = (size.couplings, size.network.width, size.network.depth, size.bins)
        self.grid = make_grid(SHELL_GRID)
        self.marginal = CouplingFlow(3, *own)
        self.conditional = CouplingFlow(self.grid.size + 3, *own)

    def log_square(self, place: Tensor, square: Tensor, normal: Tensor, channel: Tensor) -> Tensor:
        context = torch.cat((self.grid(0.5 + 0.5 * normal), channel), -1)
        where = self.marginal.log_density(place, channel)
        return where + self.conditional.log_density(square, context)


def equal_area(normal: Tensor) -> Tensor:
    """Equal-area coordinates of unit vectors, azimuth and height: [N, 3] -> [N, 2] in [0, 1]."""
    azimuth = torch.atan2(normal[:, 1], normal[:, 0]) / (2 * math.pi) + 0.5
    return torch.stack((azimuth, 0.5 + 0.5 * normal[:, 2]), -1).clamp(0, 1)


class ShellAppearance:
    """Radiance of the lamp from a density on its sphere, Eq. 2."""

    def __init__(self, description: Description, shell: Shell) -> None:
        self.description, self.shell = description, shell

    @torch.no_grad()
    def radiance(self, position: Float, normal: Float, outgoing: Float) -> Float:
        """Radiance in W/(m² sr): three of [N, 3] -> [N, 3]; the surface's normal is not used."""
        result = np.zeros_like(position)
        for i in range(0, len(position), EVALUATED):
            part = slice(i, i + EVALUATED)
            rays = [torch.from_numpy(a[part]) for a in (position, outgoing)]
            for channel in np.flatnonzero(self.description.channels):
                index = torch.full((len(rays[0]),), int(channel))
                pdf = torch.exp(self.shell.log_pdf(rays[0], rays[1], index)).numpy()
                result[part, channel] = self.description.flux[channel] * pdf
        return result
