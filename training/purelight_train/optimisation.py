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
from safetensors.torch import load_file
from torch import Tensor, nn

from purelight_train.presets import Optimisation
from purelight_train.run_directory import RunDirectory

WARM_UP = 50
GRADIENT_NORM = 10.0
CHECKPOINT_SECONDS = 20.0


class Progress(Protocol):
    """Receives steps done and the running loss."""

    def __call__(self, done: int, loss: float | None = None) -> None: ...


@dataclass
class Trace:
    """Losses, one mean per hundredth of the run, and steps skipped for non-finite gradients."""

    losses: list[float] = field(default_factory=list)
    skipped: int = 0

    def to_dict(self) -> dict[str, Any]:
        """A JSON-ready form."""
        return asdict(self)


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
) -> Trace:
    """Minimise `loss` over the module's parameters.

    Each step draws its batch from a generator seeded by (seed, step), so a resumed run sees the
    batches it would have seen. A step whose loss or gradient is not finite is skipped and counted.

    Arguments:
        loss: takes the step's random generator and returns a scalar.
        checkpoint: file for unfinished work; continued from if present, removed at the end.
    """
    parameters = [p for p in module.parameters() if p.requires_grad]
    adam = torch.optim.Adam(parameters, betas=(0.9, 0.99), eps=1e-12, fused=True)
    first = _restore(checkpoint, module, adam, parameters)
    trace, recent, saved = Trace(), [], time.monotonic()
    for step in range(first, settings.steps):
        for group in adam.param_groups:
            group["lr"] = learning_rate(step, settings)
        torch.manual_seed(seed * 1_000_003 + step)
        value = loss(np.random.default_rng([seed, step]))
        adam.zero_grad(set_to_none=True)
        value.backward()
        norm = nn.utils.clip_grad_norm_(parameters, GRADIENT_NORM)
        if torch.isfinite(norm) and torch.isfinite(value):
            adam.step()
        else:
            trace.skipped += 1
        recent.append(float(value.detach()))
        if len(recent) >= max(1, settings.steps // 100):
            trace.losses.append(float(np.mean(recent)))
            recent.clear()
            progress(step + 1, trace.losses[-1])
        if time.monotonic() - saved > CHECKPOINT_SECONDS:
            _store(checkpoint, module, adam, parameters, step + 1)
            saved = time.monotonic()
    checkpoint.unlink(missing_ok=True)
    module.eval()
    return trace


def _store(
    path: Path, module: nn.Module, adam: torch.optim.Adam, parameters: Sequence[Tensor], step: int
) -> None:
    tensors = {f"module.{k}": v for k, v in module.state_dict().items()}
    for i, parameter in enumerate(parameters):
        tensors |= {f"adam.{i}.{k}": v for k, v in adam.state[parameter].items()}
    tensors["step"] = torch.tensor(step)
    RunDirectory.save_tensors(path, tensors)


def _restore(
    path: Path, module: nn.Module, adam: torch.optim.Adam, parameters: Sequence[Tensor]
) -> int:
    if not path.is_file():
        return 0
    tensors = load_file(path)
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
    return int(tensors["step"])
