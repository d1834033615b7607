"""Optimisation: spikes of the loss and gradients that are not finite do no lasting harm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from purelight_train.presets import Optimisation
from purelight_train.runs.optimisation import Trace, UsualNorm, optimise

STEPS = 600


def fit(folder: Path, disturb: Callable[[int, Tensor], Tensor]) -> tuple[Trace, float]:
    """Fit a small network to a curve; returns the trace and the final error."""
    torch.manual_seed(0)
    module = torch.nn.Sequential(torch.nn.Linear(1, 32), torch.nn.Tanh(), torch.nn.Linear(32, 1))
    step = iter(range(STEPS))

    def error(x: Tensor) -> Tensor:
        return ((module(x) - torch.sin(3 * x)) ** 2).mean()

    def loss(rng: np.random.Generator) -> Tensor:
        x = torch.from_numpy(rng.uniform(-1, 1, (64, 1)).astype(np.float32))
        return disturb(next(step), error(x))

    settings = Optimisation(STEPS, 64, 1e-2)
    trace = optimise(module, loss, settings, 0, folder / "c", lambda *_: None)
    with torch.no_grad():
        return trace, float(error(torch.linspace(-1, 1, 500)[:, None]))


def test_spikes_are_skipped(tmp_path: Path) -> None:
    """Every twentieth loss a million times too large, in the wrong direction."""
    _, calm = fit(tmp_path, lambda step, loss: loss)
    spiked = {*range(100, STEPS, 20)}
    trace, error = fit(tmp_path, lambda step, loss: -1e6 * loss if step in spiked else loss)
    assert trace.spikes >= len(spiked)
    assert error < 3 * calm + 1e-3, (error, calm)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_steps_that_are_not_finite_change_nothing(tmp_path: Path, bad: float) -> None:
    _, calm = fit(tmp_path, lambda step, loss: loss)
    trace, error = fit(tmp_path, lambda step, loss: loss * bad if step % 10 == 3 else loss)
    assert trace.skipped == STEPS // 10
    assert np.isfinite(trace.losses).all()
    assert error < 3 * calm + 1e-3, (error, calm)


def test_the_limit_follows_the_gradients_down(tmp_path: Path) -> None:
    parameter = torch.nn.Parameter(torch.zeros(4))
    usual = UsualNorm()

    def norm_after(length: float) -> Any:
        parameter.grad = torch.full((4,), length / 2)
        spike = usual.clip([parameter])[1]
        return spike, float(parameter.grad.norm())

    for _ in range(400):
        assert norm_after(1e-3) == (False, pytest.approx(1e-3, rel=1e-4))
    assert norm_after(1.0) == (True, pytest.approx(5e-3, rel=0.2))
    assert norm_after(0.02) == (False, pytest.approx(5e-3, rel=0.2))
    assert norm_after(1e-3)[0] is False
