"""Training of networks that are declared, each when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from torch import nn

from purelight_train.light.description import Description
from purelight_train.presets import Optimisation, Preset
from purelight_train.runs.routes import Route
from purelight_train.runs.stages import Loss, Stages, rows
from purelight_train.runs.traced_lamp import TracedLamp

Module = TypeVar("Module", bound=nn.Module)
Data = TypeVar("Data")
Float = NDArray[np.float32]


@dataclass(frozen=True)
class Trained(Generic[Module]):
    """A network of a run, and how it is trained.

    What it depends on its functions ask the trainer for, which then trains that first.

    Arguments:
        name: of its stage, of its file in the run directory, and of its random numbers.
        module: makes it untrained.
        settings: how it is optimised.
        loss: gathers its data and makes its objective, of batches of a size.
        gathers: stages before its own, for the progress bars: those that gather its data.
        begin: called before its first step.
        finish: called after its last step, before it is stored.
        held_out: makes its error on held-out data, for an early stop.
        left_out: whether the lamp goes without it.
    """

    name: str
    module: Callable[[Description, Preset], Module]
    settings: Callable[[Trainer], Optimisation]
    loss: Callable[[Trainer, Module, int], Loss]
    gathers: tuple[str, ...] = ()
    begin: Callable[[Trainer, Module], object] = lambda *_: None
    finish: Callable[[Trainer, Module], object] = lambda *_: None
    held_out: Callable[[Trainer, Module], Callable[[], float]] | None = None
    left_out: Callable[[Trainer], bool] = lambda _: False

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of its stages, in order."""
        return *self.gathers, self.name


@dataclass
class Trainer:
    """The networks of one lamp in one run directory, and the data they share."""

    route: Route
    _networks: dict[str, Any] = field(default_factory=dict, init=False)
    _data: dict[Callable[..., Any], Any] = field(default_factory=dict, init=False)

    @property
    def lamp(self) -> TracedLamp:
        return self.route.lamp

    @property
    def stages(self) -> Stages:
        return self.route.stages

    @property
    def preset(self) -> Preset:
        return self.route.preset

    def has(self, declared: Trained[Any]) -> bool:
        """Whether the lamp has a network, or is to have it."""
        return self.stages.run.finished(declared.name) or not declared.left_out(self)

    def network(self, declared: Trained[Module]) -> Module:
        """A network of the lamp: trained, or loaded if an earlier run finished it."""
        if declared.name not in self._networks:
            self._networks[declared.name] = self._trained(declared)
        network: Module = self._networks[declared.name]
        return network

    def _trained(self, declared: Trained[Module]) -> Module:
        name, settings, held_out = declared.name, declared.settings(self), declared.held_out
        network = self.stages.build(name, declared.module, self.lamp.description, self.preset)
        if not self.stages.run.finished(name):
            declared.begin(self, network)
        self.stages.train(
            name, network, lambda own: declared.loss(self, own, settings.batch), settings,
            lambda: declared.finish(self, network),
            held_out and (lambda own: held_out(self, own)),
        )  # fmt: skip
        return network

    def data(self, gather: Callable[[Trainer], Data]) -> Data:
        """What a function gathers for training: once, however many networks learn it."""
        if gather not in self._data:
            self._data[gather] = gather(self)
        found: Data = self._data[gather]
        return found


def over(gather: Callable[[Trainer], tuple[Float, ...]]) -> Callable[[Trainer, Any, int], Loss]:
    """The loss of a network that has one of its own, over random rows of what is gathered."""

    def loss(trainer: Trainer, network: Any, size: int) -> Loss:
        data = trainer.stages.tensors(*trainer.data(gather))
        return lambda rng: network.loss(*rows(data, rng, size))

    return loss
