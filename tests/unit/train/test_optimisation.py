"""Optimisation: bad gradients do no lasting harm, and what is interrupted goes on."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from purelight_format.errors import PureLightError
from purelight_train.presets import Optimisation
from purelight_train.runs import optimisation
from purelight_train.runs.optimisation import Trace, UsualNorm, optimise
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import Stages

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


def test_a_training_that_leaves_out_many_steps_is_told(tmp_path: Path) -> None:
    settings = Optimisation(STEPS, 64, 1e-2)
    run = RunDirectory(tmp_path)
    for name, every in (("fair", STEPS), ("astray", 7)):
        stages, step = Stages(run, 0, torch.device("cpu"), ()), iter(range(STEPS))

        def loss(module: nn.Module, step: Any = step, every: int = every) -> Any:
            def value(rng: np.random.Generator) -> Tensor:
                far = 1e6 if next(step) % every == every - 1 else 1.0
                x = torch.from_numpy(rng.normal(size=(8, 1)).astype(np.float32))
                return far * ((module(x) - torch.sin(x)) ** 2).mean()

            return value

        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            stages.train(name, torch.nn.Linear(1, 1), loss, settings)
        assert [f"steps of the {name}" in str(w.message) for w in told] == [True] * (every == 7)


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


class Killed(BaseException):
    """What ends a process in a test."""


SETTINGS = Optimisation(100, 1, 1e-2)


def stages(folder: Path, *, early_stop: bool = False) -> Stages:
    return Stages(RunDirectory(folder), 0, torch.device("cpu"), ("it",), early_stop)


def objective(seen: list[float], broken_at: int = -1) -> Callable[[nn.Module], Any]:
    """A loss with gradients that are not finite in each tenth step; it may end the process."""

    def make(module: nn.Module) -> Any:
        def loss(rng: np.random.Generator) -> Tensor:
            if len(seen) == broken_at:
                raise Killed
            seen.append(0.0)
            x = torch.from_numpy(rng.random((8, 4)).astype(np.float32))
            value = ((module(x)[:, 0] - 1) ** 2).mean()
            return value * (float("nan") if len(seen) % 10 == 0 else 1.0)

        return loss

    return make


def network() -> nn.Module:
    torch.manual_seed(0)
    return nn.Linear(4, 1)


def test_a_resumed_run_tells_of_all_its_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Losses, skipped steps and seconds are those of the whole, not those since the last stop."""
    monkeypatch.setattr(optimisation, "CHECKPOINT_SECONDS", -1.0)
    records = []
    for name, stop in (("whole", -1), ("stopped", 55)):
        run, seen = stages(tmp_path / name), list[float]()
        if stop > 0:
            with pytest.raises(Killed):
                run.train("it", network(), objective(seen, stop), SETTINGS)
        run.train("it", network(), objective(seen), SETTINGS)
        assert len(seen) == SETTINGS.steps
        assert not list((tmp_path / name / "checkpoints").iterdir())
        records.append(run.run.read_json("networks/it.json"))
    whole, stopped = records
    np.testing.assert_allclose(stopped["losses"], whole["losses"], rtol=1e-5)
    assert len(whole["losses"]) == 90
    assert stopped["skipped"] == whole["skipped"] == 10


@pytest.mark.parametrize("early_stop", [False, True])
def test_no_step_is_lost_while_a_network_is_finished(tmp_path: Path, *, early_stop: bool) -> None:
    """Closing the flux of a large student takes minutes, its steps hours."""
    run, seen, rest, module = stages(tmp_path, early_stop=early_stop), [], [], network()

    def killed() -> None:
        module.weight.data.fill_(9.0)
        raise Killed

    held_out = {"held_out": lambda _: lambda: 1.0}
    with pytest.raises(Killed):
        run.train("it", module, objective(seen), SETTINGS, killed, **held_out)
    assert len(seen) < 30 if early_stop else len(seen) == SETTINGS.steps
    again, finished = network(), []
    run.train("it", again, objective(rest), SETTINGS, lambda: finished.append(1), **held_out)
    assert (len(rest), len(finished)) == (0, 1)
    assert float(again.weight.detach().max()) < 9
    assert run.run.read_json("networks/it.json")["losses"]
    assert not list((tmp_path / "checkpoints").iterdir())


def test_a_damaged_checkpoint_is_told_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "checkpoints" / "it.safetensors"
    file.parent.mkdir()
    file.write_bytes(b"half of")
    with pytest.raises(PureLightError, match=r"it\.safetensors: unreadable: .*begins anew"):
        stages(tmp_path).train("it", network(), objective([]), SETTINGS)


def test_a_trial_writes_nothing_into_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`purelight-size` tries networks over a run that may be another's, and read-only."""
    monkeypatch.setattr(optimisation, "CHECKPOINT_SECONDS", -1.0)
    module = network()
    stages(tmp_path / "run").try_out("it", module, objective([])(module), SETTINGS)
    assert not (tmp_path / "run").exists()
