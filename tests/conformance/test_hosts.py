"""Hosts pass the suite: ONNX Runtime, Mitsuba, generated C++, and one in another language."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from purelight_conformance import cli, maker, runner
from purelight_conformance.operations import OPERATIONS
from purelight_conformance.protocol import READER
from purelight_conformance.results import SKIPPED, Report
from purelight_conformance.suite import Suite
from purelight_conformance.text import to_text
from purelight_format.bundle import Bundle
from tests.support.compiled import require_compilers

HERE = Path(__file__).parent
NODE = HERE.parents[1] / "examples/hosts/node"
SPARED = {  # Operations that rendering in Mitsuba has no use for.
    "area_to_solid_angle", "direction_to_cap", "disk_to_square",
}  # fmt: skip


def passed(wanted: Suite, *command: str) -> Report:
    report = runner.run(wanted, command, timeout=120)
    assert report.conforms, to_text(report)
    assert not any(row["refused"] for row in report.groups().values())
    return report


def test_the_onnx_runtime_passes_everything(whole: Suite) -> None:
    report = passed(whole, sys.executable, "-m", "purelight_onnx.conformance_host")
    assert report.host.operations == OPERATIONS.keys() | {READER}


def test_the_mitsuba_runtime_passes_what_it_offers(whole: Suite) -> None:
    report = passed(whole, sys.executable, "-m", "purelight_mitsuba.conformance_host")
    assert report.host.operations == (OPERATIONS.keys() | {READER}) - SPARED
    skipped = {r.vectors.operation for r in report.results if SKIPPED in r.outcome}
    assert skipped == SPARED


CPP = (sys.executable, "-m", "purelight_shader.conformance_host")


def test_generated_code_passes_with_some_lamps(whole: Suite) -> None:
    """Each lamp is compiled anew, so two stand for all; `red` has every network, `plain` one."""
    require_compilers()
    chosen = [v for v in whole.sets if v.bundle in ("", "red", "plain")]
    report = passed(replace(whole, sets=chosen), *CPP)
    assert report.host.operations >= {"instance_sample", "view", "estimate", "area_to_solid_angle"}


@pytest.mark.slow
def test_generated_code_passes_all_but_files_and_finishes(whole: Suite) -> None:
    require_compilers()
    report = passed(whole, *CPP)
    assert report.host.operations == {v.operation for v in whole.sets} - {READER, "finish"}


def node() -> str:
    """Node.js, where it and the host's one package are installed."""
    program = shutil.which("node")
    if program is None:
        pytest.skip("Node.js is not installed")
    if not (NODE / "node_modules/onnxruntime-node").is_dir():
        pytest.skip("onnxruntime-node is not installed: make test-node installs it")
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True)
    if int(version.stdout.lstrip("v").split(".")[0]) < 20:
        pytest.skip(f"Node.js {version.stdout.strip()} is older than 20")
    return program


def test_a_host_in_another_language_passes_everything_but_vets_no_files(whole: Suite) -> None:
    report = passed(whole, node(), str(NODE / "host.mjs"))
    assert report.host.operations == {v.operation for v in whole.sets} - {READER, "finish"}
    files = report.groups()[READER]
    assert files["skipped"] == sum(files.values()) > 0
    assert f"the host does not offer: {READER}" in to_text(report)


def test_the_host_in_another_language_is_by_itself() -> None:
    files = {f"./{path.name}": path.read_text() for path in NODE.glob("*.mjs")}
    names = re.compile(r'^(?:import|} from).*"(.*)"', re.MULTILINE)
    imports = {name for text in files.values() for name in names.findall(text)}
    assert {name for name in imports if name[:5] != "node:"} - files.keys() == {"onnxruntime-node"}


def test_golden_vectors_of_a_bundle_are_put_too(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lamp = folder / "bundles/red.plux"
    host = f"{sys.executable} -m purelight_onnx.conformance_host"
    assert cli.main(["run", "--host", host, "--suite", str(folder), str(lamp)]) == 0
    assert "conforms" in capsys.readouterr().out
    vectors = maker.of_bundle(Bundle.open(lamp))
    assert {v.id.split("/")[0] for v in vectors.sets} == {"red"}
    assert all(len(v) in (21, 64) and list(v.flags) == ["GOLDEN"] for v in vectors.sets)


def test_bundles_of_one_name_are_all_counted(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also the one whose vectors are not met, whichever comes first."""
    for name in ("red", "wild"):
        (tmp_path / name).mkdir()
        shutil.copy(folder / f"bundles/{name}.plux", tmp_path / name / "lamp.plux")
    lamps = [tmp_path / "red/lamp.plux", tmp_path / "wild/lamp.plux"]
    index = json.loads((folder / "suite.json").read_text())
    (tmp_path / "suite.json").write_text(json.dumps({**index, "sets": [], "bundles": {}}))
    counts = []
    for bundles in (lamps[:1], lamps[1:], lamps, [*lamps, lamps[0]]):
        host = f"{sys.executable} {HERE / 'faulty_host.py'} swapped_channels"
        arguments = ["--suite", str(tmp_path), "--json", *map(str, bundles)]
        cli.main(["run", "--host", host, *arguments])
        report = json.loads(capsys.readouterr().out)
        counts.append(report["groups"]["appearance"])
        vectors = {failure["vector"] for failure in report["failures"]}
        assert len(vectors) == len(report["failures"]) > 0
    first, second, both, twice = counts
    assert both == twice == {key: first[key] + second[key] for key in first}
