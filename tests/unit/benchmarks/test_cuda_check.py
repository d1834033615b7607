"""The checks that a GPU is to pass, made with the variant that runs here; and planted faults."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from benchmarks.cuda import __main__ as command
from benchmarks.cuda import checks, isolated, lamp, on_device
from benchmarks.cuda.checks import FAIL, FIGURE, PASS, REFERENCE, SKIPPED, Subject, run
from purelight_conformance.lamps import LAMPS
from purelight_conformance.networks import BODIES
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.members import network as member
from purelight_format.networks.kinds import KINDS
from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Lamps
from purelight_mitsuba.translate.half_precision import half_bound
from purelight_mitsuba.translate.network import Dense

FAULTY = "llvm_faulty_rgb"
NETWORKS = [f"network {name}," for name in BODIES]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lamp.write(tmp_path_factory.mktemp("cuda") / "small.plux")


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Works in this process, quickly; what it returns plants faults in the variant FAULTY."""
    faults: list[tuple[Any, str, Any]] = []

    def call(variant: str, name: str, *arguments: Any) -> Any:
        with pytest.MonkeyPatch.context() as patch:
            for fault in faults if variant == FAULTY else ():
                patch.setattr(*fault)
            return getattr(on_device, name)(*arguments)

    monkeypatch.setattr(isolated, "call", call)
    monkeypatch.setattr(on_device, "SPP", 16)
    return lambda *fault: faults.append(fault)


def verdicts(subject: Subject, *prefixes: str) -> dict[str, str]:
    rows = list(run(subject, prefixes or ("",)))
    print(*map(command.line, rows), sep="\n")
    return {row.check: row.verdict for row in rows}


@pytest.mark.usefixtures("here")
def test_what_is_right_passes(small: Path) -> None:
    chosen = ("ray", "two", *NETWORKS, "picture, accurate, fused", "picture, fast, queued")
    found = verdicts(Subject(REFERENCE, small), *chosen)
    assert set(found.values()) == {PASS}
    assert len(found) == 1 + 2 + 2 * len(NETWORKS) + 2


@pytest.mark.usefixtures("here")
def test_figures_are_measured(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "WIDTHS", (32,))
    assert verdicts(Subject(REFERENCE, small), "virtual", "speed") == {
        "virtual calls": FIGURE,
        "speed, 32 wide": FIGURE,
    }


def test_wrong_weights_are_found_in_both_precisions(here: Callable[..., Any], small: Path) -> None:
    usual = Dense.__init__

    def spoilt(self: Dense, weight: np.ndarray, bias: np.ndarray, half: bool) -> None:
        usual(self, weight * np.float32(1.03), bias, half)

    here(Dense, "__init__", spoilt)
    found = verdicts(Subject(FAULTY, small), *NETWORKS)
    assert len(found) == 2 * len(NETWORKS)
    assert set(found.values()) == {FAIL}


def test_a_lost_bounce_is_found_in_pictures(here: Callable[..., Any], small: Path) -> None:
    here(on_device, "DEPTH", 2)
    found = verdicts(Subject(FAULTY, small), "picture, accurate, fused")
    assert found == {"picture, accurate, fused": FAIL}


def test_lamps_that_no_ray_meets_are_found(here: Callable[..., Any], small: Path) -> None:
    """As where OptiX switches the second scene of a kernel off."""
    usual = Lamps.intersect

    def intersect(self: Lamps, ray: Any, active: Any) -> Hit:
        return replace(usual(self, ray, active), valid=active & False)

    here(Lamps, "intersect", intersect)
    assert set(verdicts(Subject(FAULTY, small), "two").values()) == {FAIL}


def test_a_check_that_cannot_be_made_leaves_the_others(
    here: Callable[..., Any], small: Path
) -> None:
    def broken(*_: Any) -> Any:
        raise RuntimeError("CUDA error 700")

    here(on_device, "answers", broken)
    here(on_device, "calls", broken)
    found = verdicts(Subject(FAULTY, small), "ray", "network appearance", "virtual")
    assert found == {
        "ray": PASS,
        "network appearance, single": FAIL,
        "network appearance, half": FAIL,
        "virtual calls": checks.UNMEASURED,
    }


@pytest.mark.usefixtures("here")
def test_networks_that_the_lamp_lacks_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "faint.plux"
    LAMPS["faint"].write(path)
    found = verdicts(Subject(REFERENCE, path), "network fast_map", "picture, fast, fused")
    assert set(found.values()) == {SKIPPED}


def test_on_cuda_every_network_is_half(small: Path) -> None:
    names = list(checks.checks(Subject("cuda_ad_rgb", small)))
    assert sum(name.startswith("network") for name in names) == len(KINDS)
    assert not any("single" in name for name in names)


def test_half_layers_differ_from_single_ones(small: Path) -> None:
    half, single = (on_device.answers(small, "appearance", half) for half in (True, False))
    ratio = half["radiance"] / single["radiance"] - 1
    assert 1e-5 < np.abs(ratio).max() < 0.05


def test_the_bound_of_half_precision_is_no_free_pass(small: Path) -> None:
    opened = Bundle.open(small)
    model, vectors = opened.read(member("appearance")), opened.vectors("appearance")
    bound, judged = half_bound(model, vectors, opened.manifest.radiance_scale)
    size = np.abs(vectors.outputs["radiance"]) + opened.manifest.radiance_scale
    assert judged.mean() > 0.9
    assert (bound["radiance"] > vectors.tolerances["radiance"]).all()
    assert np.median(bound["radiance"] / size) < 0.03


@pytest.mark.parametrize(
    ("cuda", "libraries", "missing"),
    [
        (False, (), "libcuda"),
        (False, ("libcuda.so.1",), "no GPU"),
        (True, ("libcuda.so.1",), "libnvoptix"),
        (True, ("libcuda.so.1", "libnvoptix.so.1"), None),
    ],
)
def test_what_is_missing_is_named(
    cuda: bool, libraries: tuple[str, ...], missing: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dr, "has_backend", lambda _: cuda)
    monkeypatch.setattr(isolated, "_loads", lambda _, library: library in libraries)
    isolated.require_device(REFERENCE)
    if missing is None:
        isolated.require_device("cuda_ad_rgb")
        return
    with pytest.raises(PureLightError, match=missing):
        isolated.require_device("cuda_ad_rgb")


def test_a_crash_is_an_error(monkeypatch: pytest.MonkeyPatch, capfd: Any) -> None:
    monkeypatch.setattr(isolated, "_child", os.abort)  # Dies without a word to its parent.
    with pytest.raises(PureLightError, match="crashed with exit code"):
        isolated.call(REFERENCE, "traced")


@pytest.mark.skipif(
    bool(dr.has_backend(dr.JitBackend.CUDA)), reason="there is a GPU: run benchmarks.cuda itself"
)
def test_the_command_says_what_is_missing(tmp_path: Path, capfd: Any) -> None:
    assert command.main(["--output", str(tmp_path / "out")]) == 2
    output, error = capfd.readouterr()
    assert re.fullmatch(r"benchmarks.cuda: error: cuda_ad_rgb: no CUDA: .*\n", error)
    assert output == ""
    assert not (tmp_path / "out").exists()


def test_the_command(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In processes of their own, as it is on a GPU."""
    monkeypatch.setattr(checks, "LOOP_SPP", {"llvm": 2})
    words = ["--lamp", str(small), "--variant", REFERENCE, "--output", str(tmp_path / "out")]
    assert command.main([*words, "--checks", "ray", "loops"]) == 0
    report = json.loads((tmp_path / "out" / f"{REFERENCE}.json").read_text())
    assert [row["verdict"] for row in report["rows"]] == [PASS, FIGURE]


@pytest.mark.usefixtures("here")
def test_the_command_fails_where_a_check_does(
    small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checks, "TRACED", -1.0)
    words = ["--lamp", str(small), "--variant", REFERENCE, "--output", str(tmp_path)]
    assert command.main([*words, "--checks", "ray"]) == 1
    assert command.main([*words, "--checks", "nothing"]) == 2
    assert command.main(["--lamp", str(tmp_path / "none.plux"), "--variant", REFERENCE]) == 2
