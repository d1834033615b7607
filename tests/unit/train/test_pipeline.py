"""A whole run on a tiny preset: results, resuming, refusals."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.presets import (
    PRESETS,
    Optimisation,
)
from tests.support.tiny import TINY, train

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def run(lamp: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("runs") / "tiny"
    train(lamp, output)
    return output


def test_run_is_complete(run: Path) -> None:
    from purelight_train.runs.run_directory import RunDirectory

    opened = RunDirectory.open(run)
    description = opened.description
    assert opened.preset == TINY
    assert description.flux[0] > description.flux[1] > description.flux[2] > 0
    metrics = opened.read_json("metrics.json")
    np.testing.assert_allclose(metrics["student_flux"], description.flux, rtol=0.02)
    assert metrics["held_out_gain_nats"] > 0.2
    trained = {"teacher", "student", "transparency", "pilot", "sampler", "fast_map"}
    assert set(metrics["losses"]) >= trained
    escaped = opened.read_arrays("escaped.npz")
    np.testing.assert_allclose(
        escaped["weight"].sum(0, dtype=np.float64), description.flux, rtol=1e-4
    )
    triangle_flux = opened.read_arrays("surface.npz")["triangle_flux"]
    np.testing.assert_allclose(triangle_flux.sum(0, dtype=np.float64), description.flux, rtol=0.02)
    for name in ("student.png", "transparency.png", "teacher_student.png"):
        assert (run / "previews" / name).read_bytes().startswith(b"\x89PNG")
    point = torch.tensor([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1e5, 0.0, 0.0]])
    toward, pdf = opened.network("sampler", Sampler)(point, torch.rand(3, 2))
    assert torch.isfinite(toward).all()
    assert pdf[1] == 0
    assert (pdf[[0, 2]] > 0).all()


@pytest.fixture(scope="module")
def photons(lamp: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A run of the command by the other route, and the lines that it printed."""
    import purelight_train.cli

    output = tmp_path_factory.mktemp("runs") / "photons"
    words = ["--preset", "tiny", "--anchor", "both", "--device", "cpu", "--threads", "2"]
    said = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.setitem(PRESETS, "tiny", TINY)
        assert purelight_train.cli.main([str(lamp), "--output", str(output), *words]) == 0
    return output, said.getvalue().splitlines()


def test_route_photons(run: Path, photons: tuple[Path, list[str]]) -> None:
    """No teacher, the same files, and as good a likelihood."""
    from purelight_train.runs.run_directory import RunDirectory

    opened = RunDirectory.open(photons[0])
    metrics = opened.read_json("metrics.json")
    assert opened.config["route"] == "photons"
    assert list(opened.network("student", Student).anchors) == ["straight", "refracted"]
    assert "teacher" not in metrics["losses"]
    assert set(metrics["losses"]) >= {"student", "transparency", "pilot", "sampler", "fast_map"}
    np.testing.assert_allclose(metrics["student_flux"], metrics["flux"], rtol=0.02)
    np.testing.assert_allclose(metrics["flux_gain"], 1, atol=0.05)
    taught = json.loads((run / "metrics.json").read_text())
    assert metrics["held_out_gain_nats"] > taught["held_out_gain_nats"] - 0.05


def test_a_run_ends_with_its_verdict(photons: tuple[Path, list[str]]) -> None:
    """In metrics.json, on the terminal and on the report's cover."""
    run, out = photons
    metrics = json.loads((run / "metrics.json").read_text())
    verdict = read(metrics["verdict"])
    assert verdict is not None
    assert verdict.by_heart is None  # Photons are used once.
    assert metrics["seconds"]["verdict"] > 0
    told = judge(verdict, {"preset": "tiny", "anchor": "both"})
    assert out[: len(told.lines)] == list(told.lines)
    assert out[-1].startswith(f"{run}: flux ")
    assert out[-1].endswith("--output lamp.plux")
    page = (run / "report.html").read_text()
    assert told.caption in page
    assert page.count("% of white") >= 6


def test_opaque_lamp_goes_without_transparency(lamp: Path, tmp_path: Path) -> None:
    from purelight_train.runs.pipeline import start
    from purelight_train.runs.trained import TRANSPARENCY, see_through

    scene = tmp_path / "ball.xml"
    scene.write_text(
        '<scene version="3.0.0"><shape type="sphere"><bsdf type="diffuse"/>'
        '<emitter type="area"><rgb name="radiance" value="1"/></emitter></shape></scene>'
    )
    assert not start(scene, tmp_path / "ball", TINY, 0, "cpu", resume=False).has(TRANSPARENCY)
    glass = start(lamp, tmp_path / "glass", TINY, 0, "cpu", resume=False)
    assert glass.has(TRANSPARENCY)
    assert glass.data(see_through)[-1].mean() > 0.1


def test_fresh_records(lamp: Path, tmp_path: Path) -> None:
    """Records generated during optimisation teach the flow as well."""
    import copy

    from purelight_train.runs.stages import Stages

    preset = dataclasses.replace(TINY, fresh_records=True)
    from purelight_train.runs.pipeline import start

    training = start(lamp, tmp_path, preset, 0, "cpu", resume=False)
    route: Any = training.route
    assert isinstance(training.stages, Stages)
    untrained = copy.deepcopy(route.stages.build(
        "teacher", type(route.teacher.flow), training.lamp.description, preset
    ))  # fmt: skip
    held = training.lamp.held_out.take(slice(4096))
    arrays = training.stages.tensors(held.position, held.shading, held.direction)
    red = torch.zeros(4096, dtype=torch.int64)
    with torch.no_grad():
        gain = route.teacher.flow.log_pdf_projected(*arrays, red)
        gain = gain - untrained.log_pdf_projected(*arrays, red)
    assert float(gain.mean()) > 0.2


def test_interrupted_run_ends_the_same(run: Path, lamp: Path, tmp_path: Path) -> None:
    """Lose the last three networks and keep the rest: the same files come back."""
    import shutil

    again = tmp_path / "again"
    shutil.copytree(run, again)
    for name in ("transparency", "sampler", "fast_map"):
        (again / "networks" / f"{name}.safetensors").unlink()
    (again / "metrics.json").unlink()
    train(lamp, again, resume=True)
    for name in ("student", "transparency", "sampler", "fast_map"):
        old, new = (load_file(r / "networks" / f"{name}.safetensors") for r in (run, again))
        for key in old:
            torch.testing.assert_close(new[key], old[key], atol=2e-2, rtol=2e-2)


def test_checkpoint_continues_where_it_stopped(tmp_path: Path) -> None:
    """A run stopped halfway and resumed takes the same steps as one that was not."""
    from purelight_train.runs import optimisation

    target = torch.linspace(0, 1, 64)

    def loss_of(module: torch.nn.Module) -> Any:
        def loss(rng: np.random.Generator) -> torch.Tensor:
            x = torch.from_numpy(rng.random((64, 4)).astype(np.float32))
            return ((module(x)[:, 0] - target) ** 2).mean()

        return loss

    class Stop(Exception):  # noqa: N818 - a signal, not an error
        pass

    def stop(done: int, loss: float | None = None) -> None:
        if done >= 40:
            raise Stop

    settings = Optimisation(100, 64, 1e-2)
    results = []
    for interrupted in (False, True):
        torch.manual_seed(0)
        module = torch.nn.Linear(4, 1)
        file = tmp_path / f"{interrupted}.safetensors"
        if interrupted:
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(optimisation, "CHECKPOINT_SECONDS", -1.0)
                with pytest.raises(Stop):
                    optimisation.optimise(module, loss_of(module), settings, 3, file, stop)
            assert file.is_file()
            module = torch.nn.Linear(4, 1)
        optimisation.optimise(module, loss_of(module), settings, 3, file, lambda *_: None)
        assert not file.exists()
        results.append(module.weight.detach().clone())
    torch.testing.assert_close(results[0], results[1], atol=1e-6, rtol=0)


def test_bad_gradient_is_skipped_and_counted(tmp_path: Path) -> None:
    from purelight_train.runs.optimisation import optimise

    module = torch.nn.Linear(1, 1)

    def loss(rng: np.random.Generator) -> torch.Tensor:
        x = torch.tensor([[float("nan") if rng.random() < 0.3 else 1.0]])
        return ((module(x) - 2) ** 2).mean()

    trace = optimise(module, loss, Optimisation(200, 1, 5e-2), 0, tmp_path / "c", lambda *_: None)
    assert 30 < trace.skipped < 90
    assert float(module(torch.ones(1, 1))) == pytest.approx(2, abs=0.05)


def test_other_run_in_the_way(run: Path, lamp: Path) -> None:
    from purelight_format.errors import PureLightError

    with pytest.raises(PureLightError, match="--resume"):
        train(lamp, run)
    with pytest.raises(PureLightError, match="another route"):
        train(lamp, run, resume=True, route="photons")
    with pytest.raises(PureLightError, match="another preset"):
        train(lamp, run, preset=PRESETS["standard"], resume=True)


def test_networks_of_another_version_are_refused(run: Path, tmp_path: Path) -> None:
    from safetensors.torch import load_file, save_file

    from purelight_format.errors import PureLightError
    from purelight_train.runs.run_directory import RunDirectory

    copy = tmp_path / "old"
    shutil.copytree(run, copy)
    file = copy / "networks" / "student.safetensors"
    tensors = load_file(file)
    del tensors["ceiling"]
    save_file(tensors, file)
    with pytest.raises(PureLightError, match="another version; train again"):
        RunDirectory.open(copy).network("student", Student)


@pytest.mark.parametrize("rest", [0.5, 0.0])
def test_damaged_files_are_told_in_one_line(run: Path, tmp_path: Path, rest: float) -> None:
    """As a copy leaves them that broke off."""
    from purelight_format.errors import PureLightError
    from purelight_train.runs.run_directory import RunDirectory

    copy = tmp_path / "damaged"
    shutil.copytree(run, copy)
    for file in (copy / "networks" / "student.safetensors", copy / "surface.npz"):
        data = file.read_bytes()
        file.write_bytes(data[: int(rest * len(data))])
    opened = RunDirectory.open(copy)
    with pytest.raises(PureLightError, match=r"student\.safetensors: unreadable"):
        opened.network("student", Student)
    with pytest.raises(PureLightError, match=r"surface\.npz: unreadable"):
        opened.read_arrays("surface.npz")
    (copy / "description.json").write_text("{}")
    with pytest.raises(PureLightError, match=r"description\.json: made by another version"):
        _ = opened.description


def test_a_run_whose_lamp_has_changed_is_not_used_further(run: Path, tmp_path: Path) -> None:
    from purelight_format.errors import PureLightError
    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.sizes.right_size import right_size

    copy, scene = tmp_path / "run", tmp_path / "lamp.xml"
    shutil.copytree(run, copy)
    opened = RunDirectory.open(copy)
    scene.write_text(Path(opened.config["luminaire"]).read_text().replace("0.01", "0.02"))
    opened.write_json("config.json", opened.config | {"luminaire": str(scene)})
    with pytest.raises(PureLightError, match=r"lamp\.xml: is not what .*run was trained of"):
        right_size(copy, tmp_path / "small", 1.0, "cpu")
    scene.unlink()
    with pytest.raises(PureLightError, match=r"lamp\.xml: no such file"):
        right_size(copy, tmp_path / "small", 1.0, "cpu")


def test_right_size(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loose target takes the smallest student, in a run that exports like any other."""
    from purelight_format.errors import PureLightError
    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.sizes import right_size, sampling, student, transparency

    monkeypatch.setattr(student, "LINES", 1 << 17)
    monkeypatch.setattr(sampling, "POINTS", 1 << 8)
    monkeypatch.setattr(transparency, "LINES", 1 << 17)
    monkeypatch.setattr(transparency, "HELD_OUT_LINES", 1 << 16)
    monkeypatch.setattr(transparency, "TRAINING", Optimisation(60, 1 << 11, 1e-2))
    monkeypatch.setattr(sampling, "SAMPLER", Optimisation(30, 1 << 10, 1e-2))
    monkeypatch.setattr(sampling, "FAST_MAP", Optimisation(30, 1 << 5, 1e-2))
    small = tmp_path / "small"
    monkeypatch.setattr(student, "TRIAL", 10)
    monkeypatch.setattr(student, "FULL", Optimisation(20, 1 << 11, 1e-2))
    with pytest.raises(PureLightError, match="larger --target-error"):
        right_size.right_size(run, small, 1e-4, "cpu")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(student, "TRIAL", 60)
    monkeypatch.setattr(student, "FULL", Optimisation(120, 1 << 11, 1e-2))
    with pytest.raises(PureLightError, match="lies in the run"):
        right_size.right_size(run, run / "small", 10.0, "cpu")
    trials, others = right_size.right_size(run, small, 10.0, "cpu")
    before, after = (RunDirectory.open(path).network("student", Student) for path in (run, small))
    sizes = [sum(p.numel() for p in student.parameters()) for student in (before, after)]
    assert sizes[1] == trials[-1].rung.weights
    assert len(trials) == 1
    assert sizes[1] < 0.8 * sizes[0]
    report = json.loads((small / "sizes.json").read_text())
    assert report["trials"][-1]["expected_error"] <= 5
    assert others == {
        "transparency_width": 8, "transparency_finest": 12, "sampler_width": 16,
        "fast_map_width": 16,
    }  # fmt: skip
    assert RunDirectory.open(small).network("sampler", Sampler).flow is not None
    figures = [json.loads((path / "metrics.json").read_text()) for path in (run, small)]
    np.testing.assert_allclose(figures[1]["student_flux"], figures[0]["student_flux"], rtol=0.02)
    np.testing.assert_allclose(figures[1]["flux_gain"], after.gain)
    with pytest.raises(PureLightError, match="exists already"):
        right_size.right_size(run, small, 10.0, "cpu")


def test_the_portable_tier_is_trained_exported_and_stated(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from purelight_export.export import export
    from purelight_format.bundle import Bundle
    from purelight_format.summary import summary_text
    from purelight_train.sizes import portable, right_size, sampling, student

    monkeypatch.setattr(portable, "SHARES", (1.0,))
    monkeypatch.setattr(student, "LINES", 1 << 16)
    monkeypatch.setattr(student, "TRIAL", 10)
    monkeypatch.setattr(student, "FULL", Optimisation(40, 1 << 10, 1e-2))
    monkeypatch.setattr(sampling, "POINTS", 1 << 8)
    monkeypatch.setattr(sampling, "SAMPLER", Optimisation(20, 1 << 9, 1e-2))
    monkeypatch.setattr(sampling, "FAST_MAP", Optimisation(20, 1 << 5, 1e-2))
    trials, _ = right_size.right_size(run, tmp_path / "small", None, "cpu")
    assert len(trials) == 1
    assert json.loads((tmp_path / "small" / "sizes.json").read_text())["tier"] == "portable"
    for path, tier in ((tmp_path / "small", "portable"), (run, None)):
        bundle = tmp_path / f"{path.name}.plux"
        export(path, bundle)
        found = Bundle.open(bundle)
        assert found.manifest.tier == tier
        assert ("tier          portable" in summary_text(found)) == (tier is not None)


@pytest.mark.slow
def test_killed_run_resumes(lamp: Path, run: Path, tmp_path: Path) -> None:
    """Kill -9 at random moments, resume until done: equal to the uninterrupted run."""
    output = tmp_path / "killed"
    code = (
        "import sys; from pathlib import Path;"
        "from purelight_mitsuba import platform; platform.use();"
        "import torch; torch.set_num_threads(2);"
        "from tests.support import tiny;"
        "tiny.train(Path(sys.argv[1]), Path(sys.argv[2]), resume=True)"
    )
    command = [sys.executable, "-c", code, str(lamp), str(output)]
    rng = np.random.default_rng(0)
    for _ in range(10):
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL, cwd=ROOT)
        time.sleep(rng.uniform(4, 25))
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
        process.wait()
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL, cwd=ROOT)
    figures = [json.loads((r / "metrics.json").read_text()) for r in (run, output)]
    np.testing.assert_allclose(
        figures[1]["held_out_gain_nats"], figures[0]["held_out_gain_nats"], atol=0.01
    )
