"""The suite itself: its bytes, its references, and that every bug is hunted."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx.reference import ReferenceEvaluator

from purelight_conformance import broken, cli, lamps, networks, runner, sampling, suite
from purelight_conformance.flags import FLAGS
from purelight_conformance.operations import OPERATIONS, Asset
from purelight_conformance.protocol import READER
from purelight_conformance.suite import NEVER, REQUIRED, Suite, VectorSet
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.issues import CODES
from purelight_format.measures import cap, cap_to_direction
from purelight_format.networks.vectors import SIGNATURES
from purelight_format.validation.validate import validate

GROUPS = [
    "appearance", "transparency", "sampler", "sampler_pdf", "fast_map", "frames", "cap",
    "finishes", "instance", "composite", "estimators", READER,
]  # fmt: skip


def files(folder: Path) -> dict[str, bytes]:
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_two_makes_give_the_same_bytes(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["make", str(tmp_path)]) == 0
    assert "vectors" in capsys.readouterr().out
    assert files(tmp_path) == files(folder)


def test_a_missing_onnx_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "onnx", None)
    assert cli.main(["make", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "purelight[onnx]" in error
    assert error.count("\n") == 1


def test_what_is_read_is_what_was_written(whole: Suite, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "sets").mkdir()
    moved = {name: tmp_path / path.relative_to(folder) for name, path in whole.bundles.items()}
    suite.write(Suite(whole.sets, moved), tmp_path)
    again, written = files(tmp_path), files(folder)
    assert again == {name: data for name, data in written.items() if not name.endswith(".plux")}


def test_every_group_and_every_flag_has_vectors(whole: Suite) -> None:
    assert list(dict.fromkeys(v.group for v in whole.sets)) == sorted(GROUPS, key=GROUPS.index)
    hunted = {flag for v in whole.sets for flag in v.flags}
    assert hunted == FLAGS.keys() - {"GOLDEN", *(flag for _, flag, _ in sampling.TESTS.values())}
    asked = {name for name, put in OPERATIONS.items() if networks.BODIES.keys() >= set(put.needs)}
    assert {v.operation for v in whole.sets} == asked | {READER}


def test_sets_are_sound(whole: Suite) -> None:
    ids = [v.id for v in whole.sets]
    assert len(set(ids)) == len(ids)
    for v in (v for v in whole.sets if v.operation != READER):
        put = OPERATIONS[v.operation]
        assert len(v) > 0, v.id
        assert v.inputs.keys() == put.inputs.keys()
        assert v.outputs.keys() <= put.outputs.keys()
        assert bool(v.outputs) == (v.refusal != REQUIRED)
        assert (v.bundle in whole.bundles) == bool(put.needs)
        for name, array in v.outputs.items():
            assert array.shape == (len(v), *put.outputs[name])
            assert np.isfinite(array).all()
            assert (v.tolerances[name] >= 0).all()
        assert all(0 <= row < len(v) for rows in v.flags.values() for row in rows)


@pytest.mark.parametrize("name", lamps.LAMPS)
def test_the_lamps_are_valid(name: str, folder: Path) -> None:
    report = validate(folder / f"bundles/{name}.plux")
    codes = {issue.code.name for issue in report.issues}
    assert report.valid
    assert codes <= ({"PLX_MANIFEST_DARK"} if name == "black" else set())


@pytest.mark.parametrize("code", broken.FAULTS)
def test_a_file_breaks_the_rule_that_its_set_names_and_no_other(code: str, whole: Suite) -> None:
    name = code.removeprefix("PLX_").lower()
    (vectors,) = (v for v in whole.sets if v.id == f"{READER}/{name}")
    report = validate(whole.bundles[vectors.bundle])
    found = {issue.code.name for issue in report.errors or report.issues}
    assert found == {code} == {vectors.parameters["issue"]}
    assert vectors.parameters["rule"] == CODES[code].anchor
    assert vectors.refusal == (NEVER if report.valid else REQUIRED)


def test_files_are_small_and_break_rules_of_every_kind(whole: Suite) -> None:
    kinds = {code.anchor.rstrip("0123456789") for code in CODES.values()} - {"plux.md#v"}
    broken_kinds = {CODES[code].anchor.rstrip("0123456789") for code in broken.FAULTS}
    assert broken_kinds == kinds
    files = [whole.bundles[v.bundle] for v in whole.sets if v.operation == READER]
    assert set(files) == set(whole.bundles.values())
    assert sum(file.stat().st_size for file in files if file.parent.name == "files") < 1_000_000


@pytest.mark.parametrize("network", networks.BODIES)
def test_references_agree_with_the_reference_of_onnx(network: str, whole: Suite) -> None:
    """ONNX's own evaluator in float32 meets the vectors that ours gives in float64."""
    vectors = next(v for v in whole.sets if v.id == f"{network}/wild")
    lamp = Asset.of(Bundle.open(whole.bundles["wild"]))
    evaluator = ReferenceEvaluator(onnx.load_from_string(lamp.models[network]))
    with np.errstate(all="ignore"):
        answers = evaluator.run(None, {k: np.array(v) for k, v in vectors.inputs.items()})
    outputs = dict(zip(SIGNATURES[network].outputs, answers, strict=True))
    assert runner.compare(vectors, outputs).failures == ()


def test_the_sampler_has_the_density_that_it_states(whole: Suite) -> None:
    """Its density is that of `sampler_pdf`, integrates to one, and is that of its directions."""
    lamp = Asset.of(Bundle.open(whole.bundles["wild"]))
    side = (np.arange(128) + 0.5) / 128
    u = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    sphere = lamp.manifest.bounding_sphere
    point = np.tile(
        np.array(sphere.center) + sphere.radius * np.array([1.0, 2.0, -0.5]), (len(u), 1)
    )
    view = cap(point, sphere)
    even = lamp("sampler_pdf", np.float64, point=point, toward=cap_to_direction(u, view))
    mean = even["pdf_solid_angle"].mean() * view.solid_angle[0]
    drawn = lamp("sampler", np.float64, point=point, u=u)
    again = lamp("sampler_pdf", np.float64, point=point, toward=drawn["toward"])
    inverse = (1 / drawn["pdf_solid_angle"]).mean() / view.solid_angle[0]
    np.testing.assert_allclose(mean, 1, rtol=1e-6)  # The weights are float32.
    np.testing.assert_allclose(again["pdf_solid_angle"], drawn["pdf_solid_angle"], rtol=1e-9)
    np.testing.assert_allclose(inverse, 1, rtol=0.03)  # E[1 / pdf] is the solid angle.


@pytest.mark.parametrize("damage", ["{", '{"version": "2.0"}', '{"version": "1.0"}', "[]"])
def test_a_damaged_suite_is_one_line(damage: str, tmp_path: Path) -> None:
    (tmp_path / suite.INDEX).write_text(damage)
    with pytest.raises(PureLightError, match=suite.INDEX) as caught:
        suite.read(tmp_path)
    assert "\n" not in str(caught.value)


def vector_set(rows: int | None, tolerance: float = 0.1) -> VectorSet:
    inputs = {"u": np.zeros((2, 2), np.float32)}
    outputs = {"disk": np.array([[1.0, 2.0], [3.0, 4.0]])}
    tolerances = {"disk": np.full((2, 2), tolerance)}
    flags = {"U_EDGE": [1]}
    return VectorSet("a", "g", "square_to_disk", "", inputs, outputs, tolerances, flags, rows=rows)


def test_every_copy_of_a_vector_must_be_met() -> None:
    vectors = vector_set(5)
    answer = vectors.outputs["disk"][[0, 1, 0, 1, 0]]
    assert runner.compare(vectors, {"disk": answer}).failures == ()
    answer[3, 0] += 0.2
    (failure,) = runner.compare(vectors, {"disk": answer}).failures
    assert (failure.vector, failure.hunts) == ("a/1", ("U_EDGE",))
    assert "0.2" in failure.what


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_not_met(value: float) -> None:
    vectors = vector_set(None, np.inf)
    answer = vectors.outputs["disk"].copy()
    answer[0, 1] = value
    assert [f.vector for f in runner.compare(vectors, {"disk": answer}).failures] == ["a/0"]


def edited(folder: Path, whole: Suite, tmp_path: Path, change: Callable[[Any], None]) -> Path:
    """A copy of the suite whose index has been changed."""
    shutil.copytree(folder, tmp_path / "suite")
    path = tmp_path / "suite" / suite.INDEX
    index = json.loads(path.read_text())
    change(index)
    path.write_text(json.dumps(index))
    return tmp_path / "suite"


def with_set(**fields: Any) -> Callable[[Any], None]:
    return lambda index: index["sets"][0].update(fields)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda index: index["bundles"].update(plain="/etc/passwd"), "not in the suite's folder"),
        (lambda index: index["bundles"].update(plain="../lamp.plux"), "not in the suite's folder"),
        (lambda index: index["bundles"].update(plain="link/passwd"), "not in the suite's folder"),
        (with_set(file="/etc/passwd"), "not in the suite's folder"),
        (with_set(file="fifo"), "not a regular file"),
        (with_set(file="n\0l"), "damaged"),
        (with_set(rows=1 << 40), "damaged"),
        (with_set(average=0), "damaged"),
        (with_set(flags={"GOLDEN": [[0, 1 << 60]]}), "damaged"),
        (with_set(inputs={"x": {"dtype": "|O", "shape": [1], "offset": 0}}), "damaged"),
        (with_set(inputs={"x": {"dtype": "<f4", "shape": [-1], "offset": 0}}), "damaged"),
        (with_set(inputs={"x": {"dtype": "<f4", "shape": [1 << 62, 4], "offset": 0}}), "damaged"),
        (lambda index: index.update(sets=[0]), "damaged"),
        (lambda index: index["sets"].append(index["sets"][0]), "two sets have one id"),
        (lambda index: index["bundles"].pop("wild"), "no bundle wild"),
        (with_set(parameters=[1]), "no object"),
        (with_set(parameters={"dimmer": math.nan}), "NaN is no number"),
        (with_set(refusal="perhaps"), "refusal perhaps"),
        (with_set(average=3), "damaged"),
        (with_set(tolerances={}), "damaged"),
        (with_set(flags={"GOLDEN": [[0, 1000]]}), "a vector that there is not"),
        (with_set(outputs={"x": {"dtype": "<f8", "shape": [1, 3], "offset": 0}}), "does not fit"),
    ],
)
def test_a_suite_from_a_stranger_reaches_nothing_else(
    change: Callable[[Any], None], said: str, folder: Path, whole: Suite, tmp_path: Path
) -> None:
    path = edited(folder, whole, tmp_path, change)
    (path / "link").symlink_to("/etc")
    os.mkfifo(path / "fifo")
    with pytest.raises(PureLightError, match=said):
        suite.read(path)


def test_a_suite_nested_too_deep_or_too_large_is_refused(tmp_path: Path) -> None:
    (tmp_path / suite.INDEX).write_text("[" * 100_000)
    with pytest.raises(PureLightError, match="damaged"):
        suite.read(tmp_path)
    (tmp_path / suite.INDEX).write_bytes(b" " * (suite.INDEX_BYTES + 1))
    with pytest.raises(PureLightError, match="bytes, at most"):
        suite.read(tmp_path)
