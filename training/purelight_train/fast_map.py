"""Fast map (paper Sec. 3.5): a 16x16 radiance map of the lamp as seen from a point."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.description import Description
from purelight_train.encodings import MLP
from purelight_train.point_encoding import PointEncoding
from purelight_train.presets import Preset
from purelight_train.student import MAX_LOG

SIZE = 16


class FastMap(nn.Module):
    """Mean radiance in the 16x16 equal cells of the cap's square, [row v, column u, channel].

    One network serves all channels; its input is [encoding(point), one-hot channel].
    """

    channels: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        self.encoding = PointEncoding(description, preset.point_grid)
        size = preset.fast_map_network
        self.network = MLP(self.encoding.size + 3, SIZE * SIZE, size.width, size.depth)
        self.radiance_scale = description.radiance_scale
        present = torch.tensor(description.channels, dtype=torch.float32)
        self.register_buffer("channels", present, persistent=False)

    def log_map(self, point: Tensor) -> Tensor:
        """log1p(radiance / scale), clipped: [N, 3] -> [N, 256, 3]."""
        context = self.encoding(point)
        outputs = []
        for channel in range(3):
            one_hot = torch.zeros(len(point), 3, dtype=context.dtype, device=context.device)
            one_hot[:, channel] = 1
            outputs.append(self.network(torch.cat((context, one_hot), -1)))
        return torch.stack(outputs, -1).clamp(0, MAX_LOG)

    def forward(self, point: Tensor) -> Tensor:
        """Radiance map in W/(m² sr): [N, 3] -> [N, 16, 16, 3]."""
        radiance = torch.expm1(self.log_map(point)) * (self.radiance_scale * self.channels)
        return radiance.view(-1, SIZE, SIZE, 3)

    def loss(self, point: Tensor, radiance: Tensor) -> Tensor:
        """Mean square error of radiance / scale, as the paper: energy first, and unbiased.

        Arguments:
            point: [N, 3].
            radiance: [N, 256, 3], one random sample in each cell.
        """
        value = torch.expm1(self.log_map(point)) * self.channels
        return ((value - radiance / self.radiance_scale) ** 2).mean()
