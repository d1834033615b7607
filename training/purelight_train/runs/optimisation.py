"""One optimisation: Adam with a cosine schedule, checkpoints, and recovery from bad steps."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn

from purelight_format.errors import PureLightError
from purelight_train.presets import Optimisation
from purelight_train.runs.early_stop import EarlyStop
from purelight_train.runs.run_directory import RunDirectory

WARM_UP = 50
GRADIENT_NORM = 10.0
LONG, SPIKE = 5.0, 50.0  # times the running mean: gradients clipped, and gradients skipped
MEMORY = 0.98  # of the running mean
MANY_SPIKES = 0.01  # of the steps; a sound training has one at most
CHECKPOINT_SECONDS = 20.0


class Progress(Protocol):
    """Receives steps done and the running loss."""

    def __call__(self, done: int, loss: float | None = None) -> None: ...


@dataclass
class Trace:
    """Losses, one mean per hundredth of the run, and steps skipped for non-finite gradients.

    `spikes` counts the steps skipped because their gradient was far too long (`UsualNorm`), and
    `step_seconds` the time that all steps took. A resumed run goes on counting.
    """

    losses: list[float] = field(default_factory=list)
    skipped: int = 0
    spikes: int = 0
    step_seconds: float = 0.0

    def astray(self, steps: int) -> bool:
        """Whether so many steps were spikes that those which count are no fair sample."""
        return self.spikes > max(MANY_SPIKES * steps, 1)

    def to_dict(self) -> dict[str, Any]:
        """A JSON-ready form."""
        return asdict(self) | {"step_seconds": round(self.step_seconds, 2)}


class UsualNorm:
    """Tells gradients that are far longer than those before them, clips long ones.

    A fixed limit lets through spikes a thousand times the usual length. Adam then steps in the
    spike's direction, and hardly moves for the hundred steps in which its second moment forgets.

    Nothing is judged before `WARM_UP` gradients have been seen.

    Attributes:
        mean: running geometric mean of the norms.
        seen: how many went into it.
    """

    def __init__(self) -> None:
        self.mean, self.seen = 1.0, 0

    def clip(self, parameters: Sequence[Tensor]) -> tuple[float, bool]:
        """Clip the parameters' gradients; returns their norm before and whether it is a spike."""
        usual = self.mean if self.seen >= WARM_UP else math.inf
        limit = min(GRADIENT_NORM, LONG * usual)
        norm = float(nn.utils.clip_grad_norm_(parameters, limit))
        if math.isfinite(norm) and norm > 0:
            memory = min(MEMORY, self.seen / (self.seen + 1))
            self.mean = self.mean**memory * min(norm, limit) ** (1 - memory)
            self.seen += 1
        return norm, norm > SPIKE * usual


def learning_rate(step: int, settings: Optimisation) -> float:
    """Linear warm-up, then a cosine down to one percent of the peak."""
    warm = min(1.0, (step + 1) / WARM_UP)
    cosine = 0.5 * (1 + math.cos(math.pi * step / settings.steps))
    return settings.learning_rate * warm * (0.01 + 0.99 * cosine)


def optimise(
    module: nn.Module,
    loss: Callable[[np.random.Generator], Tensor],
    settings: Optimisation,
    seed: int,
    checkpoint: Path,
    progress: Progress,
    stop: EarlyStop | None = None,
    *,
    keep: bool = False,
) -> Trace:
    """Minimise `loss` over the module's parameters.

    Each step draws its batch from a generator seeded by (seed, step), so a resumed run sees the
    batches it would have seen, but for those of a `photon_batches.Stream`, which goes on with rows
    that it has not given. A step whose loss or gradient is not finite, or whose gradient
    is far longer than usual, is skipped and counted.

    Arguments:
        loss: takes the step's random generator and returns a scalar.
        checkpoint: file for unfinished work; continued from if present, removed at the end.
        stop: may end it before all steps are taken.
        keep: leave a checkpoint after all steps, for a caller who has more to do, and removes it.

    Raises:
        PureLightError: the checkpoint cannot be read.
    """
    parameters = [p for p in module.parameters() if p.requires_grad]
    adam = torch.optim.Adam(parameters, betas=(0.9, 0.99), eps=1e-12, fused=True)
    usual = UsualNorm()
    trace, recent = Trace(), list[float]()
    first = _restore(checkpoint, module, adam, parameters, usual, trace, recent)
    done = settings.steps
    begun = saved = time.monotonic()
    before = trace.step_seconds
    for step in range(first, settings.steps):
        factor = stop.factor(step, settings.steps) if stop else 1.0
        if factor == 0:
            done = step
            break
        for group in adam.param_groups:
            group["lr"] = factor * learning_rate(step, settings)
        torch.manual_seed(seed * 1_000_003 + step)
        value = loss(np.random.default_rng([seed, step]))
        adam.zero_grad(set_to_none=True)
        value.backward()
        norm, spike = usual.clip(parameters)
        if not (math.isfinite(norm) and torch.isfinite(value)):
            trace.skipped += 1
        elif spike:
            trace.spikes += 1
        else:
            adam.step()
            recent.append(float(value.detach()))
        if (step + 1) % max(1, settings.steps // 100) == 0 and recent:
            trace.losses.append(float(np.mean(recent)))
            recent.clear()
            progress(step + 1, trace.losses[-1])
            if stop:
                stop.check(step + 1, settings.steps)
        trace.step_seconds = before + time.monotonic() - begun
        if time.monotonic() - saved > CHECKPOINT_SECONDS:
            _store(checkpoint, module, adam, parameters, usual, step + 1, trace, recent)
            saved = time.monotonic()
    if keep:
        _store(checkpoint, module, adam, parameters, usual, done, trace, recent)
    else:
        checkpoint.unlink(missing_ok=True)
        if stop:
            stop.done()
    module.eval()
    return trace


def _store(
    path: Path,
    module: nn.Module,
    adam: torch.optim.Adam,
    parameters: Sequence[Tensor],
    usual: UsualNorm,
    step: int,
    trace: Trace,
    recent: list[float],
) -> None:
    tensors = {f"module.{k}": v for k, v in module.state_dict().items()}
    for i, parameter in enumerate(parameters):
        tensors |= {f"adam.{i}.{k}": v for k, v in adam.state[parameter].items()}
    norm = torch.tensor((usual.mean, usual.seen), dtype=torch.float64)
    counts = torch.tensor((trace.skipped, trace.spikes, trace.step_seconds), dtype=torch.float64)
    losses, rest = (torch.tensor(v, dtype=torch.float64) for v in (trace.losses, recent))
    tensors |= {"step": torch.tensor(step), "norm": norm}
    tensors |= {"losses": losses, "recent": rest, "counts": counts}
    RunDirectory.save_tensors(path, tensors)


def _restore(
    path: Path,
    module: nn.Module,
    adam: torch.optim.Adam,
    parameters: Sequence[Tensor],
    usual: UsualNorm,
    trace: Trace,
    recent: list[float],
) -> int:
    if not path.is_file():
        return 0
    try:
        tensors = load_file(path)
    except SafetensorError as error:
        raise PureLightError(
            f"{path}: unreadable: {error}; remove it, and this network begins anew"
        ) from None
    prefix = "module."
    module.load_state_dict(
        {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
    )
    for i, parameter in enumerate(parameters):
        adam.state[parameter] = {
            k: tensors[f"adam.{i}.{k}"].to(parameter.device if k != "step" else "cpu")
            for k in ("step", "exp_avg", "exp_avg_sq")
            if f"adam.{i}.{k}" in tensors
        }
    usual.mean, usual.seen = float(tensors["norm"][0]), int(tensors["norm"][1])
    if "counts" in tensors:  # Not in checkpoints of before.
        trace.losses, recent[:] = tensors["losses"].tolist(), tensors["recent"].tolist()
        skipped, spikes, trace.step_seconds = tensors["counts"].tolist()
        trace.skipped, trace.spikes = int(skipped), int(spikes)
    return int(tensors["step"])
