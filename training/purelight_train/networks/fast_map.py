"""Fast map (paper Sec. 3.5): a 16x16 radiance map of the lamp as seen from a point."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP
from purelight_train.networks.point_encoding import PointEncoding
from purelight_train.networks.student import MAX_LOG
from purelight_train.presets import Preset

SIZE = 16
DIM = 0.1  # of the usual mean of maps; darker ones count no more


class FastMap(nn.Module):
    """Mean radiance in the 16x16 equal cells of the cap's square, [row v, column u, channel].

    With `fast_map_one_hot`, as in the paper, the network's input is [encoding(point), one-hot
    channel], and it is evaluated once a channel; otherwise one evaluation gives all channels,
    for a third of the work. A gain per channel closes the power that the map sends to points all
    around, and no cell is brighter than any it learned from (`close_power`).
    """

    channels: Tensor
    gain: Tensor
    scale: Tensor
    ceiling: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        self.encoding = PointEncoding(description, preset.point_grid)
        self.one_hot = preset.fast_map_one_hot
        size, cells = preset.fast_map_network, SIZE * SIZE
        inputs, outputs = (3, cells) if self.one_hot else (0, 3 * cells)
        self.network = MLP(self.encoding.size + inputs, outputs, size.width, size.depth)
        self.register_buffer("scale", torch.tensor(description.channel_scale), persistent=False)
        present = torch.tensor(description.channels, dtype=torch.float32)
        self.register_buffer("channels", present, persistent=False)
        self.register_buffer("gain", torch.ones(3))
        self.register_buffer("ceiling", torch.full((3,), MAX_LOG))

    def raw(self, point: Tensor) -> Tensor:
        """log1p(radiance / scale) before clipping: [N, 3] -> [N, 256, 3]."""
        context = self.encoding(point)
        if not self.one_hot:
            joint: Tensor = self.network(context).view(-1, 3, SIZE * SIZE).transpose(1, 2)
            return joint
        outputs = []
        for channel in range(3):
            one_hot = torch.zeros(len(point), 3, dtype=context.dtype, device=context.device)
            one_hot[:, channel] = 1
            outputs.append(self.network(torch.cat((context, one_hot), -1)))
        return torch.stack(outputs, -1)

    def forward(self, point: Tensor) -> Tensor:
        """Radiance map in W/(m² sr): [N, 3] -> [N, 16, 16, 3]."""
        log = torch.minimum(self.raw(point).clamp(min=0), self.ceiling)
        radiance = torch.expm1(log) * (self.scale * self.gain * self.channels)
        return radiance.view(-1, SIZE, SIZE, 3)

    def loss(self, point: Tensor, radiance: Tensor) -> Tensor:
        r"""Square errors of cells, and of the sum of a map, relative to its mean.

        .. math:: E_p\big[(E_k[(v_k - L_k)^2] / 256 + E_k[v_k^+ - L_k]^2) / m^2\big]

        with L an estimate of each cell k of a point p, v the map, clipped at zero in the second
        term, and m its own mean, through which no gradient goes, so that the least is at the mean
        of L (the paper's loss has the first term with m = 1). Few bright views or cells would
        outweigh all others, dark cells that stray to both sides of zero would add light, and what
        lights a surface is the sum.

        Arguments:
            point: [N, 3].
            radiance: [N, 256, 3], an estimate of each cell without bias.
        """
        # Not clipped below: a cell that strayed under zero would have no gradient to come back
        value = torch.expm1(self.raw(point).clamp(max=MAX_LOG))
        lit, target = value.clamp(min=0), radiance / self.scale
        usual = DIM * target.mean((0, 1)) + 1e-30
        weight = self.channels / (lit.detach().mean(1, keepdim=True) + usual) ** 2
        of_mean = (lit - target).mean(1, keepdim=True)
        return (((value - target) ** 2 / (SIZE * SIZE) + of_mean**2) * weight).mean()

    @torch.no_grad()
    def close_power(self, point: Tensor, radiance: Tensor) -> None:
        """Set the ceiling to the brightest sample, and the gain so that light agrees.

        That is the mean ratio of true to told light over views, dim ones (`DIM`) for less: sums
        over all views would be those of the few brightest.
        """
        brightest = (radiance / self.scale).amax((0, 1))
        self.ceiling.copy_(torch.log1p(brightest).clamp(max=MAX_LOG))
        told = torch.cat([self(part).mean((1, 2)) for part in point.split(1024)])
        true = radiance.mean(1)
        weight = 1 / (told + DIM * told.mean(0) + 1e-30)
        known, total = (told * weight).sum(0), (true * weight).sum(0)
        self.gain *= torch.where(known > 0, total / known, torch.ones_like(known))
