"""Student (paper Sec. 3.3): radiance on the exit surface, distilled from the teacher."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.description import Description
from purelight_train.presets import Preset
from purelight_train.surface_network import SurfaceNetwork

DEGREE = 5
NORMAL_JITTER = 0.05  # radians
MAX_LOG = 20.0


class Student(SurfaceNetwork):
    r"""Radiance :math:`g_c\,s_c\,(e^{y_c} - 1)` from the network's outputs y in [0, 20].

    s is the mean exitant radiance of the channel, so that the network learns log1p of a quantity
    near one whatever the lamp's power; g is a gain per channel that closes the flux. Channels
    that carry no flux give exactly zero.
    """

    scale: Tensor
    gain: Tensor
    channels: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(description, preset.student_grid, DEGREE, preset.student_network)
        self.register_buffer("scale", torch.tensor(description.channel_scale), persistent=False)
        self.register_buffer("gain", torch.ones(3))
        present = torch.tensor(description.channels, dtype=torch.float32)
        self.register_buffer("channels", present, persistent=False)

    def forward(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """Radiance in W/(m² sr) per channel: three of [N, 3] -> [N, 3]."""
        log = self.raw(position, normal, outgoing).clamp(0, MAX_LOG)
        return torch.expm1(log) * (self.scale * self.gain * self.channels)

    def loss(self, position: Tensor, normal: Tensor, outgoing: Tensor, radiance: Tensor) -> Tensor:
        """Mean square error in log1p(radiance / scale), over the channels present.

        Normals are shaken by about `NORMAL_JITTER`: the light of tessellated curves does not jump
        from facet to facet as their normals do, so small differences must not matter.
        """
        target = torch.log1p(radiance / self.scale)
        shaken = nn.functional.normalize(normal + NORMAL_JITTER * torch.randn_like(normal), dim=-1)
        error = (self.raw(position, shaken, outgoing) - target) ** 2
        return (error * self.channels).sum() / (self.channels.sum() * len(error))
