"""A sampler of 16x16 cells instead of a flow (paper Sec. 4.5, after Zhu et al. 2021)."""

from __future__ import annotations

import torch
from torch import Tensor

from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP
from purelight_train.networks.fast_map import SIZE
from purelight_train.networks.sampler import Sampler
from purelight_train.presets import Preset


class HistogramSampler(Sampler):
    """`Sampler` with a density that is constant in each cell of the cap's square.

    Its network is as wide and as deep as the fast map's.
    """

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(description, preset)
        del self.flow
        size = preset.fast_map_network
        self.network = MLP(self.encoding.size, SIZE * SIZE, size.width, size.depth)

    def learned_log_density(self, z: Tensor, context: Tensor) -> Tensor:
        column, row = (z * SIZE).long().clamp(0, SIZE - 1).unbind(-1)
        log_share = torch.log_softmax(self.network(context), -1)
        cell = (row * SIZE + column)[:, None]
        return log_share.gather(-1, cell)[:, 0] + torch.log(torch.tensor(float(SIZE * SIZE)))

    def warp(self, u: Tensor, context: Tensor) -> Tensor:
        """Invert the rows' cumulative shares, then those of the columns in the row."""
        share = torch.softmax(self.network(context), -1).view(-1, SIZE, SIZE)
        row, v = _invert(share.sum(-1), u[:, 1])
        within = share[torch.arange(len(row)), row]
        column, w = _invert(within, u[:, 0])
        return torch.stack((column + w, row + v), -1) / SIZE


def _invert(share: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
    """Cell [N] that holds a uniform [N] under shares [N, K], and the place within it [N]."""
    cumulative = share.cumsum(-1)
    target = u * cumulative[:, -1]
    cell = (target[:, None] >= cumulative[:, :-1]).sum(-1)
    own = share.gather(-1, cell[:, None])[:, 0]
    end = cumulative.gather(-1, cell[:, None])[:, 0]
    return cell, (1 - (end - target) / own.clamp(min=1e-30)).clamp(0, 1 - 2**-24)
