"""Stages of a training run: each has its own random numbers, progress, and result on disk."""

from __future__ import annotations

import tempfile
import time
import warnings
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP
from purelight_train.presets import Optimisation, Preset
from purelight_train.runs.early_stop import EarlyStop
from purelight_train.runs.optimisation import optimise
from purelight_train.runs.progress import Bar
from purelight_train.runs.run_directory import RunDirectory

Loss = Callable[[np.random.Generator], Tensor]
Module = TypeVar("Module", bound=nn.Module)
# Their places number the random streams of these stages; others have numbers by their names
NUMBERED = (
    "light", "teacher", "distillation", "student", "transparency", "cap", "pilot", "aim",
    "sampler", "fast_map", "metrics",
)  # fmt: skip
ASTRAY = (
    "{} steps of the {} were left out, their gradients far longer than usual: it may have gone "
    "astray; look at its curve in report.html, and train with another --seed if it jumps"
)


@dataclass
class Stages:
    """What every stage of one run shares.

    Random numbers come from (seed, stage), so any stage can be repeated or resumed alone.

    Arguments:
        names: the stages of this run, in order, for the progress bars.
        early_stop: end optimisations whose held-out error has stopped falling (`early_stop`).
        seconds: time of the stages so far that train no network.
    """

    run: RunDirectory
    seed: int
    device: torch.device
    names: tuple[str, ...]
    early_stop: bool = False
    seconds: dict[str, float] = field(default_factory=dict)

    def bar(self, name: str, total: int, unit: str) -> Bar:
        """A progress bar that notes the stage's time."""
        number = f"[{self.names.index(name) + 1}/{len(self.names)}] " if name in self.names else ""
        title = f"{number}{name}"
        return Bar(title, total, unit, lambda s: self.seconds.setdefault(name, s))

    def rng(self, stage: str, part: int = 0) -> np.random.Generator:
        """Random numbers of a stage, or of the metrics."""
        return np.random.default_rng([self.seed, number(stage), part])

    def build(
        self,
        name: str,
        kind: Callable[[Description, Preset], Module],
        description: Description,
        preset: Preset,
    ) -> Module:
        """A network with initial weights that depend on the seed and the stage only."""
        torch.manual_seed(self.seed * 1009 + number(name))
        module = kind(description, preset).to(self.device)
        for part in module.modules():
            if isinstance(part, MLP):
                part.mixed = preset.mixed_precision
        return module

    def train(
        self,
        name: str,
        module: Module,
        loss: Callable[[Module], Loss],
        settings: Optimisation,
        finish: Callable[[], object] = lambda: None,
        held_out: Callable[[Module], Callable[[], float]] | None = None,
    ) -> None:
        """Optimise a network, or load it when an earlier run finished it.

        The checkpoint of the last step goes when the network is stored, so that a run which is
        interrupted while `finish` works loses no steps.

        Arguments:
            loss: makes the objective; called only when there is something to optimise.
            finish: called before the network is stored.
            held_out: makes the network's error on held-out data, for an early stop.
        """
        if self.run.finished(name):
            self.run.load(name, module)
            module.to(self.device)
            return
        objective, seed = loss(module), self.seed * 1009 + number(name)
        checkpoint = self.run.path / "checkpoints" / f"{name}.safetensors"
        stop, state = None, checkpoint.with_suffix(".stop.json")
        if self.early_stop and held_out:
            stop = EarlyStop(held_out(module), state)
        with self.bar(name, settings.steps, "step") as update:
            trace = optimise(module, objective, settings, seed, checkpoint, update, stop, keep=True)
        astray = trace.astray(settings.steps)
        if astray:
            warnings.warn(ASTRAY.format(trace.spikes, name.replace("_", " ")), stacklevel=2)
        start = time.monotonic()
        finish()
        seconds = trace.step_seconds + time.monotonic() - start
        record = {"seconds": round(seconds, 2), **trace.to_dict(), "astray": astray}
        self.run.save(name, module, record)
        for file in (checkpoint, state):
            file.unlink(missing_ok=True)

    def try_out(self, name: str, module: nn.Module, loss: Loss, settings: Optimisation) -> None:
        """Optimise a network that the run may not keep; an interrupted one begins anew.

        Nothing is written into the run, which may be another's, or tried by two at once.
        """
        with (
            tempfile.TemporaryDirectory() as folder,
            Bar(name, settings.steps, "step", lambda _: None) as update,
        ):
            checkpoint = Path(folder) / "trial.safetensors"
            optimise(module, loss, settings, self.seed, checkpoint, update)

    def tensors(self, *arrays: NDArray[np.float32]) -> tuple[Tensor, ...]:
        """Arrays as tensors on the run's device."""
        return tuple(torch.from_numpy(a).to(self.device) for a in arrays)

    def metrics(self) -> dict[str, Any]:
        """Time, losses and skipped steps of the stages, for metrics.json."""
        records = {
            name: self.run.read_json(f"networks/{name}.json")
            for name in self.names
            if (self.run.path / "networks" / f"{name}.json").is_file()
        }
        return {
            "seconds": {
                **{k: round(v, 2) for k, v in self.seconds.items()},
                **{k: v["seconds"] for k, v in records.items()},
            },
            "losses": {k: v["losses"] for k, v in records.items()},
            "skipped_steps": {k: v["skipped"] for k, v in records.items()},
            "astray": {k: v["spikes"] for k, v in records.items() if v.get("astray")},
        }


def number(stage: str) -> int:
    """What seeds a stage's random numbers, whatever other stages there are."""
    return NUMBERED.index(stage) if stage in NUMBERED else zlib.crc32(stage.encode())


def rows(data: tuple[Tensor, ...], rng: np.random.Generator, size: int) -> tuple[Tensor, ...]:
    """The same random rows of several tensors."""
    index = torch.from_numpy(rng.integers(0, len(data[0]), size)).to(data[0].device)
    return tuple(t[index] for t in data)
