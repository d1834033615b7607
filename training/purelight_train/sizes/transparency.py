"""Right size of the transparency: the smallest that predicts as well what comes through."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn

from purelight_train.learning.training_sets import transmittance_set
from purelight_train.networks.transparency import DEGREE, Transparency
from purelight_train.presets import Optimisation, Preset
from purelight_train.runs.pipeline import Training
from purelight_train.runs.stages import rows
from purelight_train.runs.trained import TRANSPARENCY
from purelight_train.sizes.ladder import SHARES, part_of, unit_points
from purelight_train.sizes.portable import fits, transparencies

LINES, HELD_OUT_LINES = 1 << 21, 1 << 18
TRAINING = Optimisation(1500, 1 << 13, 1e-2)


@dataclass
class TransparencySize:
    """Search for one finished run.

    Candidates learn lines through the lamp itself: the run's own transparency has learned some of
    the noise of rough glass by heart, which a smaller one cannot and need not. A candidate is near
    enough if its square error over lines that neither learned is larger by less than `target`.
    """

    training: Training
    target: float

    def __call__(self, preset: Preset) -> tuple[Preset, dict[str, nn.Module]]:
        """The smallest transparency, or the run's own, and the preset with its size."""
        if not self.training.stages.run.finished("transparency"):
            return preset, {}
        own = self.training.network(TRANSPARENCY)
        data, held_out = self._lines(LINES, 1), self._lines(HELD_OUT_LINES, 2)
        bound = square_error(own, held_out) * (1 + self.target)
        for sized in self._sizes(preset):
            network = self._train(sized, data)
            if square_error(network, held_out) <= bound:
                return sized, {"transparency": network}
        return preset, {"transparency": own}

    def portable(self, preset: Preset) -> tuple[Preset, dict[str, nn.Module]]:
        """The largest transparency of the portable tier, or the run's own if it is of the tier."""
        if not self.training.stages.run.finished("transparency"):
            return preset, {}
        if fits(preset.transparency_grids, preset.transparency_network, DEGREE):
            return preset, {"transparency": self.training.network(TRANSPARENCY)}
        sized = next(transparencies(preset))
        return sized, {"transparency": self._train(sized, self._lines(LINES, 1))}

    def _lines(self, lines: int, part: int) -> tuple[Tensor, ...]:
        """Position, normal, outgoing and a random transmittance of lines through the lamp."""
        stages, luminaire = self.training.stages, self.training.lamp.modelled
        rng = stages.rng("transparency", part)
        return stages.tensors(*transmittance_set(luminaire, lines, rng, stages.seed + 50 + part))

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

        width = preset.transparency_network.width
        stages.try_out(f"transparency {width}", network, loss, TRAINING)
        return network


@torch.no_grad()
def square_error(network: Transparency, held_out: tuple[Tensor, ...]) -> float:
    """Mean square error of transmittances, their own variance included."""
    return float(network.loss(*held_out))
