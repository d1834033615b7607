"""Right size of the transparency: the smallest that lets through what the run's own does."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from purelight_train.learning.training_sets import answers
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Optimisation, Preset
from purelight_train.runs.evaluation import as_function
from purelight_train.runs.pipeline import Training
from purelight_train.runs.stages import rows
from purelight_train.sizes.ladder import SHARES, part_of, unit_points

LINES, HELD_OUT_LINES = 1 << 20, 1 << 16
TRAINING = Optimisation(1500, 1 << 13, 1e-2)


@dataclass
class TransparencySize:
    """Search for one finished run, whose own transparency is what all candidates learn.

    A candidate is near enough if over uniform rays that none learned it differs by less than
    `target` times the mean transmittance: that much light comes through at the wrong place.
    """

    training: Training
    target: float

    def __call__(self, preset: Preset) -> tuple[Preset, Transparency | None]:
        """The smallest transparency, or the run's own, and the preset with its size."""
        if not self.training.stages.run.finished("transparency"):
            return preset, None
        data, held_out = self._rays(LINES, 1), self._rays(HELD_OUT_LINES, 2)
        for sized in self._sizes(preset):
            network = self._train(sized, data)
            if difference(network, held_out) <= self.target:
                return sized, network
        return preset, self.training.transparency

    def _rays(self, lines: int, part: int) -> tuple[Tensor, ...]:
        """Position, normal, outgoing and transmittance of uniform rays."""
        stages, own = self.training.stages, self.training.transparency
        assert own is not None
        transmittance, rng = as_function(own, stages.device), stages.rng("transparency", part)
        return stages.tensors(*answers(transmittance, self.training.lamp.surface, lines, rng))

    def _sizes(self, preset: Preset) -> list[Preset]:
        """The preset with smaller transparencies, from the smallest."""
        unit = unit_points(self.training.lamp.surface, self.training.stages.rng("transparency", 3))
        grid, network = preset.transparency_grid, preset.transparency_network
        parts = (part_of(grid, network, share, unit) for share in SHARES if share < 1)
        return [replace(preset, transparency_grid=g, transparency_network=n) for g, n in parts]

    def _train(self, preset: Preset, data: tuple[Tensor, ...]) -> Transparency:
        stages, description = self.training.stages, self.training.lamp.description
        network = stages.build("transparency", Transparency, description, preset)

        def loss(rng: np.random.Generator) -> Tensor:
            return network.loss(*rows(data, rng, TRAINING.batch))

        stages.try_out(network, loss, TRAINING)
        return network


@torch.no_grad()
def difference(network: Transparency, held_out: tuple[Tensor, ...]) -> float:
    """Mean absolute error over rays, as a part of their mean transmittance."""
    *rays, true = held_out
    return float((network(*rays) - true).abs().mean() / true.mean().clamp(min=1e-6))
