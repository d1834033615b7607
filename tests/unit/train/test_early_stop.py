"""Early stop: cuts runs that have learned all they can, and no others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from purelight_train.presets import Optimisation
from purelight_train.runs import optimisation
from purelight_train.runs.early_stop import COOLING, PATIENCE, EarlyStop
from purelight_train.runs.optimisation import optimise

STEPS = 1000
SETTINGS = Optimisation(STEPS, 64, 1e-2)
Loss = Callable[[np.random.Generator], torch.Tensor]


def line() -> tuple[torch.nn.Linear, Loss, Callable[[], float]]:
    """A line to fit through noisy points, and its true error."""
    torch.manual_seed(0)
    module = torch.nn.Linear(1, 1)

    def loss(rng: np.random.Generator) -> torch.Tensor:
        x = torch.from_numpy(rng.random((64, 1)).astype(np.float32))
        noise = torch.from_numpy(rng.normal(size=(64, 1)).astype(np.float32))
        return ((module(x) - (2 * x - 1 + 0.3 * noise)) ** 2).mean()

    @torch.no_grad()
    def error() -> float:
        x = torch.linspace(0, 1, 101)[:, None]
        return float(((module(x) - (2 * x - 1)) ** 2).mean())

    return module, loss, error


def fit(folder: Path, stop: EarlyStop | None, calls: list[int], model: object = None) -> None:
    module, loss, _ = model or line()  # type: ignore[misc]
    optimise(module, loss, SETTINGS, 3, folder / "c", lambda n, _=None: calls.append(n), stop)


def test_ends_when_nothing_more_is_learned(tmp_path: Path) -> None:
    whole, early = line(), line()
    calls: list[int] = []
    fit(tmp_path, None, [], whole)
    stop = EarlyStop(early[2], tmp_path / "stop.json")
    fit(tmp_path, stop, calls, early)
    assert calls[-1] < 0.8 * STEPS
    assert stop.state.cooling is not None
    assert calls[-1] == pytest.approx(stop.state.cooling + COOLING * STEPS, abs=STEPS / 100)
    assert early[2]() < whole[2]() + 2e-3
    assert not (tmp_path / "stop.json").exists()


def test_goes_on_while_there_is_something_to_learn(tmp_path: Path) -> None:
    falling = iter(np.linspace(1, 0, 100))
    calls: list[int] = []
    stop = EarlyStop(lambda: float(next(falling)), tmp_path / "stop.json")
    fit(tmp_path, stop, calls)
    assert calls[-1] == STEPS
    assert stop.state.cooling is None


def test_errors_that_are_not_finite_are_no_gain(tmp_path: Path) -> None:
    calls: list[int] = []
    stop = EarlyStop(lambda: float("nan"), tmp_path / "stop.json")
    fit(tmp_path, stop, calls)
    assert stop.state.cooling == PATIENCE * STEPS // 100
    assert calls[-1] < STEPS


def test_resumed_run_stops_at_the_same_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed before and during the cooling, with a checkpoint after every step."""
    monkeypatch.setattr(optimisation, "CHECKPOINT_SECONDS", -1.0)

    class Killed(Exception):  # noqa: N818 - a signal, not an error
        pass

    weights, ends = [], []
    for kills in ((), (70, 190)):
        folder = tmp_path / str(len(kills))
        module, loss, error = line()
        for kill in (*kills, None):
            calls: list[int] = []

            def progress(
                n: int, _: float | None = None, kill: int | None = kill, calls: list[int] = calls
            ) -> None:
                calls.append(n)
                if n == kill:
                    raise Killed

            stop = EarlyStop(error, folder / "stop.json", gain=0.05)
            try:
                optimise(module, loss, SETTINGS, 3, folder / "c", progress, stop)
            except Killed:
                with torch.no_grad():
                    module.weight.fill_(9)
        weights.append(module.weight.detach().clone())
        ends.append(calls[-1])
    assert ends[0] == ends[1] < STEPS
    torch.testing.assert_close(weights[0], weights[1], atol=1e-6, rtol=0)
