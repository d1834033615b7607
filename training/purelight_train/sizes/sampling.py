"""Right size of what samples a lamp: the narrowest sampler and fast map that lose little."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypedDict, TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from purelight_train.learning.aimed_samples import aimed_samples, cell_means
from purelight_train.learning.cap_samples import CapSamples, learned_points
from purelight_train.learning.map_closure import close_light
from purelight_train.learning.training_sets import SamplerBatches
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.presets import FlowSize, MLPSize, Optimisation, Preset
from purelight_train.runs import trained
from purelight_train.runs.evaluation import as_function
from purelight_train.runs.pipeline import Training
from purelight_train.runs.stages import rows
from purelight_train.sizes import portable

POINTS, HELD_OUT_POINTS, DRAWS = 1 << 16, 1 << 12, 1 << 16
WIDTHS = (16, 20, 24, 32, 48, 64, 96, 128)
DEPTH, BINS = 2, 16
SAMPLER = Optimisation(2400, 1 << 12, 2e-2)
FAST_MAP = Optimisation(3000, 1 << 8, 1e-2)
Module = TypeVar("Module", bound=nn.Module)


class Networks(TypedDict):
    """What was found, by name."""

    sampler: Sampler
    fast_map: FastMap


@dataclass
class SamplerSizes:
    """Search for one finished run, whose own student is what all candidates learn.

    A candidate is near enough if it loses less than `target` against the run's own network on
    directions that neither learned: for the sampler in nats, which is about half of what the
    relative variance of its weights grows by; for the fast map in nats of the cells' light.
    """

    training: Training
    target: float

    def __post_init__(self) -> None:
        self.samples = self._look(POINTS, 1)
        self.held_out = self._look(HELD_OUT_POINTS, 2)

    def _look(self, points: int, part: int) -> CapSamples:
        training, stages, lamp = self.training, self.training.stages, self.training.lamp
        radiance = as_function(training.student, stages.device)
        seen, pilot = (lamp.description, lamp.surface, radiance), training.network(trained.SAMPLER)
        rng = stages.rng("cap", part)
        point = learned_points(lamp.description, lamp.records, points, rng)
        even = CapSamples.gather(*seen, point, rng)
        return aimed_samples(even, pilot, *seen, stages.rng("aim", part))

    def _batches(self, samples: CapSamples) -> SamplerBatches:
        """What a sampler learns from."""
        training = self.training
        return SamplerBatches(samples, training.lamp.description, training.stages.device)

    def _maps(self, samples: CapSamples) -> tuple[Tensor, ...]:
        """What a fast map learns from: points and estimates of their cells."""
        return self.training.stages.tensors(samples.point, cell_means(samples))

    def __call__(self, preset: Preset) -> tuple[Preset, Networks]:
        """The smallest networks, or the run's own, and the preset with their sizes."""
        preset, sampler = self._sampler(preset)
        preset, fast_map = self._fast_map(preset)
        return preset, {"sampler": sampler, "fast_map": fast_map}

    def portable(self, preset: Preset) -> tuple[Preset, Networks]:
        """Networks of the portable tier."""
        sized = portable.sampling(preset)
        sampler, fast_map = self._trained_sampler(sized), self._trained_map(sized)
        return sized, {"sampler": sampler, "fast_map": fast_map}

    # Sampler

    def _sampler(self, preset: Preset) -> tuple[Preset, Sampler]:
        own = self.training.network(trained.SAMPLER)
        bound = self._nats(own) + self.target
        flow = self.training.preset.sampler_flow
        for width in narrower(flow.network.width):
            sized = replace(preset, sampler_flow=FlowSize(2, MLPSize(width, DEPTH), BINS))
            network = self._trained_sampler(sized)
            if self._nats(network) <= bound:
                return sized, network
        return preset, own

    def _trained_sampler(self, sized: Preset) -> Sampler:
        batches = self._batches(self.samples)
        network = self._build("sampler", Sampler, sized)

        def loss(rng: np.random.Generator) -> Tensor:
            z, point = batches.draw(rng, SAMPLER.batch)
            return -network.log_density(z, point).mean()

        name = f"sampler {sized.sampler_flow.network.width}"
        self.training.stages.try_out(name, network, loss, SAMPLER)
        return network

    @torch.no_grad()
    def _nats(self, sampler: Sampler) -> float:
        """Minus the log-likelihood of held-out light under the defensive mixture."""
        draws = self._batches(self.held_out).draw(np.random.default_rng(0), DRAWS)
        b = sampler.uniform_fraction
        log = sampler.log_density(*draws)
        return -float(torch.log((1 - b) * torch.exp(log) + b).mean())

    # Fast map

    def _fast_map(self, preset: Preset) -> tuple[Preset, FastMap]:
        own, size = self.training.network(trained.FAST_MAP), self.training.preset.fast_map_network
        held_out = self._maps(self.held_out)
        bound = _held_out_loss(own, held_out) + self.target
        for width in narrower(size.width):
            sized = replace(preset, fast_map_network=MLPSize(width, DEPTH), fast_map_one_hot=False)
            network = self._trained_map(sized)
            if _held_out_loss(network, held_out) <= bound:
                return sized, network
        return preset, own

    def _trained_map(self, sized: Preset) -> FastMap:
        data, network = self._maps(self.samples), self._build("fast_map", FastMap, sized)

        def loss(rng: np.random.Generator) -> Tensor:
            return network.loss(*rows(data, rng, FAST_MAP.batch))

        name = f"fast map {sized.fast_map_network.width}"
        self.training.stages.try_out(name, network, loss, FAST_MAP)
        network.set_ceiling(data[1])
        close_light(network, self.training.lamp.records)
        return network

    def _build(self, name: str, kind: Callable[..., Module], preset: Preset) -> Module:
        return self.training.stages.build(name, kind, self.training.lamp.description, preset)


@torch.no_grad()
def _held_out_loss(fast_map: FastMap, held_out: tuple[Tensor, ...]) -> float:
    """Of a map over held-out estimates, in nats; their noise adds the same to every map's."""
    return float(fast_map.loss(*held_out))


def narrower(width: int) -> Iterator[int]:
    """Widths to try, from the narrowest."""
    return (w for w in WIDTHS if w < width)
