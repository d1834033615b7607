"""Transparency (paper Sec. 3.3): RGB transmittance of the line through the whole lamp."""

from __future__ import annotations

import torch
from torch import Tensor

from purelight_train.light.description import Description
from purelight_train.networks.surface_network import SurfaceNetwork
from purelight_train.presets import Preset

DEGREE = 3


class Transparency(SurfaceNetwork):
    """Transmittance in [0, 1] per channel, for the line that enters at position along -outgoing.

    Wires and filaments inside are shadows of a line, whichever wall it enters by: with
    `transparency_anchor` the network is told the line's point nearest the lamp's centre, too.
    """

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(
            description, preset.transparency_grid, DEGREE, preset.transparency_network,
            preset.transparency_anchors,
        )  # fmt: skip

    def forward(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """Transmittance: three of [N, 3] -> [N, 3]."""
        return torch.sigmoid(self.raw(position, normal, outgoing))

    def loss(self, position: Tensor, normal: Tensor, outgoing: Tensor, sample: Tensor) -> Tensor:
        """Mean square error, whose minimiser is the mean of the random samples."""
        return ((self(position, normal, outgoing) - sample) ** 2).mean()
