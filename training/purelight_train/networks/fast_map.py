"""Fast map (paper Sec. 3.5): a 16x16 radiance map of the lamp as seen from a point."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor, nn

from purelight_format.color import LUMINANCE
from purelight_format.measures import cap, log_distance
from purelight_format.namespace import A, namespace
from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP, SphericalHarmonics
from purelight_train.networks.point_encoding import PointEncoding
from purelight_train.networks.student import DEGREE, LEAST_LOG, MAX_LOG
from purelight_train.presets import Preset

SIZE = 16
CELLS = SIZE * SIZE
SIDE = 4  # blocks to a side of the map, and cells to a side of a block
BLOCKS = SIDE * SIDE
MOST_TINT = 10.0  # of its logarithm
OF_SUM = 4.0  # weight of a map's sum against its cells
DIM = 0.1  # of `Description.even_map`; darker maps count no more
KNOTS = 6  # of the gain over distance
NEAREST = 1.5  # radii, of the first; just before the lamp a map of cells says little
MOST_GAIN = 1.0  # of its logarithm; beyond a beam, harmonics may say anything


class FastMap(nn.Module):
    r"""Mean radiance in the 16x16 equal cells of the cap's square, [row v, column u, channel].

    With `fast_map_one_hot`, as in the paper, the network's input is [encoding(point), one-hot
    channel], and it is evaluated once a channel. Otherwise one evaluation gives the brightness of
    each cell and a tint to each block of 4x4, for a third of the work. A gain of each channel,

    .. math:: g_c(p) = \exp \sum_j h_j(d)\,t_{jc} \cdot Y(e),

    of harmonics Y of the direction e to the lamp, whose weights are linear between six distances
    (hats h of their logarithm), makes the map's light that of traced photons, side by side
    (`map_closure`). It is between 1/e and e. No cell is brighter, before that, than any it learned
    from (`set_ceiling`).
    """

    channels: Tensor
    tilt: Tensor
    scale: Tensor
    ceiling: Tensor
    share: Tensor
    usual: Tensor

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__()
        self.encoding = PointEncoding(description, preset.point_grid)
        self.one_hot = preset.fast_map_one_hot
        size = preset.fast_map_network
        inputs, self.tints = (3, 0) if self.one_hot else (0, 3 * BLOCKS)
        inputs += self.encoding.size
        self.network = MLP(inputs, CELLS + self.tints + 1, size.width, size.depth)
        self.level = nn.Linear(inputs, 1)
        self.harmonics = SphericalHarmonics(DEGREE)
        self.register_buffer("scale", torch.tensor(description.channel_scale), persistent=False)
        present = np.array(description.channels, np.float32)
        luminance = LUMINANCE * (present if present.any() else 1)
        share = (luminance / luminance.sum()).astype(np.float32)
        usual = torch.tensor(description.even_map) / self.scale
        self.register_buffer("usual", usual, persistent=False)
        self.register_buffer("channels", torch.tensor(present), persistent=False)
        self.register_buffer("share", torch.tensor(share), persistent=False)
        self.register_buffer("tilt", torch.zeros(KNOTS, 3, self.harmonics.size))
        self.register_buffer("ceiling", torch.full((3 if self.one_hot else 1,), MAX_LOG))

    def value(self, point: Tensor, most: float | Tensor) -> Tensor:
        r"""Radiance over scale and gain: [N, 3] -> [N, 256, 3].

        A level times a shape, so that what is learned of one leaves the other as it is:

        .. math:: b_k = 256\,e^s\,\frac{e^{x_k}}{\sum_j e^{x_j}}

        with x the network's output for each cell, and s its last one and a linear function of its
        input. With `one_hot` this is the radiance of a channel; else it is the brightness of all,
        times a tint of y, an output for each block and channel,

        .. math:: v_c = b\,t_c, \quad t_c = e^{y_c} / \sum_j w_j e^{y_j}

        with w the channels' `share` in luminance, so that :math:`\sum_c w_c v_c = b`.

        Arguments:
            most: what log b is limited to; it is never below `LEAST_LOG`.
        """
        context = self.encoding(point)
        if self.one_hot:
            return self._by_channel(context, most)
        b, y = self._cells(context, most)
        # [N, channel, row of blocks, row in it, column]
        brightness = b.view(-1, 1, SIDE, SIDE, SIZE)
        tint = self._tint(y).view(-1, 3, SIDE, 1, SIDE).repeat_interleave(SIDE, -1)
        return (brightness * tint).view(-1, 3, CELLS).transpose(1, 2)

    def _by_channel(self, context: Tensor, most: float | Tensor) -> Tensor:
        limits = torch.as_tensor(most, dtype=context.dtype, device=context.device).expand(3)
        outputs = []
        for channel, limit in enumerate(limits):
            one_hot = torch.zeros(len(context), 3, dtype=context.dtype, device=context.device)
            one_hot[:, channel] = 1
            outputs.append(self._cells(torch.cat((context, one_hot), -1), limit)[0])
        return torch.stack(outputs, -1)

    def _cells(self, features: Tensor, most: float | Tensor) -> tuple[Tensor, Tensor]:
        """Brightness of every cell, [N, 256], and what is left of the network's output."""
        x, y, s = self.network(features).split([CELLS, self.tints, 1], -1)
        level = (s + self.level(features)).clamp(LEAST_LOG, MAX_LOG)
        log = level + math.log(CELLS) + torch.log_softmax(x, -1)
        return torch.exp(log.clamp(min=LEAST_LOG).clamp(max=most)), y

    def _tint(self, y: Tensor) -> Tensor:
        """Of every block: [N, 3 * 16] -> [N, 3, 16]."""
        tint = y.clamp(-MOST_TINT, MOST_TINT).exp().view(-1, 3, BLOCKS)
        return tint / (tint * self.share[:, None]).sum(1, keepdim=True)

    def brightness(self, radiance: Tensor) -> Tensor:
        """What the ceiling limits, of radiance over scale: [..., 3] -> [..., 3 or 1]."""
        return radiance if self.one_hot else (radiance * self.share).sum(-1, keepdim=True)

    def forward(self, point: Tensor) -> Tensor:
        """Radiance map in W/(m² sr): [N, 3] -> [N, 16, 16, 3]."""
        gain = torch.exp(self.log_tilt(point)) * (self.scale * self.channels)
        return (self.value(point, self.ceiling) * gain[:, None]).view(-1, SIZE, SIZE, 3)

    def knot_distances(self) -> list[float]:
        """Where the gain has its knots, in radii, up to `r_max`."""
        return np.geomspace(NEAREST, self.encoding.r_max, KNOTS).tolist()

    def log_tilt(self, point: Tensor) -> Tensor:
        """Logarithm of the gain: [N, 3] -> [N, 3]."""
        sphere, r_max = self.encoding.sphere, self.encoding.r_max
        harmonics = self.harmonics(cap(point, sphere).axis)
        hat = torch.stack(hats(log_distance(point, sphere, r_max), r_max))
        tilt = torch.einsum("jn,nh,jch->nc", hat, harmonics, self.tilt)
        return tilt.clamp(-MOST_GAIN, MOST_GAIN)

    def loss(self, point: Tensor, radiance: Tensor) -> Tensor:
        r"""Poisson deviance of cells, and of a map's sum (McCullagh & Nelder 1989).

        .. math:: E_p\big[(E_k[D(L_k, v_k)] + 4 D(E_k[L_k], E_k[v_k])) / m\big],
            \quad D(L, v) = L \log(L / v) - L + v

        with L an estimate of each cell k of a point p, v the map and m its own mean, through which
        no gradient goes, so that the least is at the mean of L. The first term is the deviance of
        the sum and, in nats, the Kullback-Leibler divergence of the shape; the second weighs the
        sum, which is what lights a surface that faces the lamp. The paper's square error of cells
        has its least there too, but of a filament that one sample in a hundred meets it learns
        the average over all views alone: its gradient is the noise of the few brightest samples.

        Arguments:
            point: [N, 3].
            radiance: [N, 256, 3], an estimate of each cell without bias.
        """
        value, target = self.value(point, MAX_LOG), radiance / self.scale
        mean = value.detach().mean(1, keepdim=True) + DIM * self.usual + 1e-30
        sums = _deviance(target.mean(1, keepdim=True), value.mean(1, keepdim=True))
        return ((_deviance(target, value) + OF_SUM * sums) / mean * self.channels).mean()

    @torch.no_grad()
    def set_ceiling(self, radiance: Tensor) -> None:
        """Set the ceiling to the brightest of the cells that it learned from: [N, 256, 3]."""
        brightest = self.brightness(radiance / self.scale).amax((0, 1))
        self.ceiling.copy_(torch.log(brightest).clamp(LEAST_LOG, MAX_LOG))


def hats(share: A, r_max: float) -> list[A]:
    """Linear pieces between `KNOTS` even places, which add up to one: [N] each.

    Arguments:
        share: [N] of `log_distance`; the first place is that of `NEAREST`, the last 1.
    """
    xp = namespace(share)
    first, last = math.log(NEAREST) / math.log(r_max), KNOTS - 1.0
    place = xp.clip((share - first) * (last / (1.0 - first)), 0.0, last)
    return [xp.relu(1.0 - abs(place - float(knot))) for knot in range(KNOTS)]


def _deviance(target: Tensor, value: Tensor) -> Tensor:
    """Half the deviance of a Poisson variable: zero where both agree, else above."""
    return torch.xlogy(target, target) - torch.xlogy(target, value) - target + value
