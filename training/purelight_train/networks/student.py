"""Student (paper Sec. 3.3): radiance on the exit surface, as one small network."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.networks.surface_network import SurfaceNetwork
from purelight_train.presets import Preset

DEGREE = 5
NORMAL_JITTER = 0.05  # radians
MAX_LOG, LEAST_LOG = 20.0, -20.0


class Student(SurfaceNetwork):
    r"""Radiance :math:`g_c(\omega)\,s_c\,\ell(y_c)` from the network's outputs y.

    The link is :math:`\ell(y) = e^y - 1` with y in [0, 20] (`log1p`: distilled, as in the paper)
    or :math:`\ell(y) = e^y` with y in [-20, 20] (`log`: fitted to photons, whose likelihood needs
    the logarithm of the radiance). s is the mean exitant radiance of the channel, so that the
    network learns a quantity near one whatever the lamp's power. The gain
    :math:`g_c(\omega) = g_c \exp(t_c \cdot Y(\omega))` closes the flux, in all and by direction
    (`flux_closure.tilt`). Channels that carry no flux give exactly zero.

    A trained student says y <= `ceiling`, one for each channel: the exponential of what a network
    makes of rays it never met has no bound of its own (`evaluation.set_ceiling`).
    """

    scale: Tensor
    gain: Tensor
    tilt: Tensor
    ceiling: Tensor
    channels: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(
            description, preset.student_grid, DEGREE, preset.student_network, preset.anchors,
            preset.lift,
        )  # fmt: skip
        self.link = preset.student_link
        self.register_buffer("scale", torch.tensor(description.channel_scale), persistent=False)
        self.register_buffer("gain", torch.ones(3))
        self.register_buffer("tilt", torch.zeros(3, self.harmonics.size))
        self.register_buffer("ceiling", torch.full((3,), MAX_LOG))
        present = torch.tensor(description.channels, dtype=torch.float32)
        self.register_buffer("channels", present, persistent=False)

    @property
    def least_log(self) -> float:
        """Least output that counts."""
        return LEAST_LOG if self.link == "log" else 0.0

    def forward(
        self, position: Tensor, normal: Tensor, outgoing: Tensor, encoded: Tensor | None = None
    ) -> Tensor:
        """Radiance in W/(m² sr) per channel: [N, 3] each -> [N, 3]; `encoded` as for `raw`."""
        raw = self.raw(position, normal, outgoing, encoded).clamp(min=self.least_log)
        raw = torch.minimum(raw, self.ceiling)
        unit = torch.exp(raw) if self.link == "log" else torch.expm1(raw)
        return unit * torch.exp(self.log_tilt(outgoing)) * (self.scale * self.gain * self.channels)

    def log_tilt(self, outgoing: Tensor) -> Tensor:
        r"""The part :math:`t_c \cdot Y(\omega)` of the gain's logarithm: [N, 3] -> [N, 3]."""
        tilted: Tensor = self.harmonics(outgoing) @ self.tilt.T
        return tilted

    def log_radiance(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """log(radiance / scale), without gain and bounds, for the link `log`: [N, 3].

        Within bounds, what strayed beyond them would have no gradient to come back by.
        """
        return self.raw(position, normal, outgoing, shaken(normal))

    def loss(self, position: Tensor, normal: Tensor, outgoing: Tensor, radiance: Tensor) -> Tensor:
        """Mean square error in log1p(radiance / scale), over the channels present."""
        target = torch.log1p(radiance / self.scale)
        error = (self.raw(position, normal, outgoing, shaken(normal)) - target) ** 2
        return (error * self.channels).sum() / (self.channels.sum() * len(error))


def shaken(normal: Tensor) -> Tensor:
    """Normals [N, 3] moved by about `NORMAL_JITTER`, to be encoded while training.

    The light of tessellated curves does not jump from facet to facet as their normals do, so small
    differences must not matter. Where a normal steers refraction it stays as it is.
    """
    return nn.functional.normalize(normal + NORMAL_JITTER * torch.randn_like(normal), dim=-1)
