"""Fast map (paper Sec. 3.5): a 16x16 radiance map of the lamp as seen from a point."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from purelight_format.color import LUMINANCE
from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP
from purelight_train.networks.point_encoding import PointEncoding
from purelight_train.networks.student import MAX_LOG
from purelight_train.presets import Preset

SIZE = 16
CELLS = SIZE * SIZE
SIDE = 4  # blocks to a side of the map, and cells to a side of a block
BLOCKS = SIDE * SIDE
MOST_TINT = 10.0  # of its logarithm
DIM = 0.1  # of the usual mean of maps; darker ones count no more


class FastMap(nn.Module):
    """Mean radiance in the 16x16 equal cells of the cap's square, [row v, column u, channel].

    With `fast_map_one_hot`, as in the paper, the network's input is [encoding(point), one-hot
    channel], and it is evaluated once a channel. Otherwise one evaluation gives the brightness of
    each cell and a tint to each block of 4x4, for a third of the work. A gain per channel closes
    the power that the map sends to points all around, and no cell is brighter than any it learned
    from (`close_power`).
    """

    channels: Tensor
    gain: Tensor
    scale: Tensor
    ceiling: Tensor
    share: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        self.encoding = PointEncoding(description, preset.point_grid)
        self.one_hot = preset.fast_map_one_hot
        size = preset.fast_map_network
        inputs, outputs = (3, CELLS) if self.one_hot else (0, CELLS + 3 * BLOCKS)
        self.network = MLP(self.encoding.size + inputs, outputs, size.width, size.depth)
        self.register_buffer("scale", torch.tensor(description.channel_scale), persistent=False)
        present = np.array(description.channels, np.float32)
        luminance = LUMINANCE * (present if present.any() else 1)
        share = (luminance / luminance.sum()).astype(np.float32)
        self.register_buffer("channels", torch.tensor(present), persistent=False)
        self.register_buffer("share", torch.tensor(share), persistent=False)
        self.register_buffer("gain", torch.ones(3))
        self.register_buffer("ceiling", torch.full((3 if self.one_hot else 1,), MAX_LOG))

    def value(self, point: Tensor, least: float, most: float | Tensor) -> Tensor:
        r"""Radiance over scale and gain: [N, 3] -> [N, 256, 3].

        With `one_hot` :math:`e^x - 1`, x the network's output for a channel; else brightness b
        times tint t of x, an output for each cell, and y, one for each block and channel,

        .. math:: v_c = b\,t_c, \quad b = e^x - 1, \quad t_c = e^{y_c} / \sum_j w_j e^{y_j}

        with w the channels' `share` in luminance, so that :math:`\sum_c w_c v_c = b`.

        Arguments:
            least, most: what x is limited to.
        """
        context = self.encoding(point)
        if self.one_hot:
            return torch.expm1(_limited(self._by_channel(context), least, most))
        x, y = self.network(context).split([CELLS, 3 * BLOCKS], -1)
        # [N, channel, row of blocks, row in it, column]
        brightness = torch.expm1(_limited(x, least, most)).view(-1, 1, SIDE, SIDE, SIZE)
        tint = self._tint(y).view(-1, 3, SIDE, 1, SIDE).repeat_interleave(SIDE, -1)
        return (brightness * tint).view(-1, 3, CELLS).transpose(1, 2)

    def _by_channel(self, context: Tensor) -> Tensor:
        outputs = []
        for channel in range(3):
            one_hot = torch.zeros(len(context), 3, dtype=context.dtype, device=context.device)
            one_hot[:, channel] = 1
            outputs.append(self.network(torch.cat((context, one_hot), -1)))
        return torch.stack(outputs, -1)

    def _tint(self, y: Tensor) -> Tensor:
        """Of every block: [N, 3 * 16] -> [N, 3, 16]."""
        tint = y.clamp(-MOST_TINT, MOST_TINT).exp().view(-1, 3, BLOCKS)
        return tint / (tint * self.share[:, None]).sum(1, keepdim=True)

    def brightness(self, radiance: Tensor) -> Tensor:
        """What the ceiling limits, of radiance over scale: [..., 3] -> [..., 3 or 1]."""
        return radiance if self.one_hot else (radiance * self.share).sum(-1, keepdim=True)

    def forward(self, point: Tensor) -> Tensor:
        """Radiance map in W/(m² sr): [N, 3] -> [N, 16, 16, 3]."""
        value = self.value(point, 0.0, self.ceiling)
        return (value * (self.scale * self.gain * self.channels)).view(-1, SIZE, SIZE, 3)

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
        value = self.value(point, -MAX_LOG, MAX_LOG)
        lit, target = value.clamp(min=0), radiance / self.scale
        usual = DIM * target.mean((0, 1)) + 1e-30
        weight = self.channels / (lit.detach().mean(1, keepdim=True) + usual) ** 2
        of_mean = (lit - target).mean(1, keepdim=True)
        return (((value - target) ** 2 / CELLS + of_mean**2) * weight).mean()

    @torch.no_grad()
    def close_power(self, point: Tensor, radiance: Tensor) -> None:
        """Set the ceiling to the brightest sample, and the gain so that light agrees.

        That is the mean ratio of true to told light over views, dim ones (`DIM`) for less: sums
        over all views would be those of the few brightest.
        """
        brightest = self.brightness(radiance / self.scale).amax((0, 1))
        self.ceiling.copy_(torch.log1p(brightest).clamp(max=MAX_LOG))
        told = torch.cat([self(part).mean((1, 2)) for part in point.split(1024)])
        true = radiance.mean(1)
        weight = 1 / (told + DIM * told.mean(0) + 1e-30)
        known, total = (told * weight).sum(0), (true * weight).sum(0)
        self.gain *= torch.where(known > 0, total / known, torch.ones_like(known))


def _limited(x: Tensor, least: float, most: float | Tensor) -> Tensor:
    """No less than `least`, no more than `most`; the latter may be of each channel."""
    return torch.minimum(x.clamp(min=least), torch.as_tensor(most, dtype=x.dtype, device=x.device))
