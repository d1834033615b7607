"""A run directory becomes a bundle."""

from __future__ import annotations

import io
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from photompy import IESFile
from PIL import Image
from pxr import Usd, UsdUtils

from purelight_export import cli
from purelight_export.export import export
from purelight_export.networks import EXPORTED
from purelight_format import bundle
from purelight_format.bundle import Bundle
from purelight_format.color import lumens
from purelight_format.errors import PureLightError
from purelight_format.networks import golden
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.vectors import SIGNATURES
from purelight_format.usd import asset_layer
from purelight_format.validation.validate import validate
from purelight_format.verdict.figures import read
from purelight_onnx.luminaire import Luminaire
from purelight_train.networks.student import Student
from purelight_train.runs.run_directory import RunDirectory
from tests.support.verdicts import FINE


@pytest.fixture(scope="session")
def lamp(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("lamp") / "lamp.plux"
    export(run_directory, output, name="Test Lamp")
    return output


def test_every_kind_of_network_can_be_exported() -> None:
    """What `--networks` offers is known without the networks themselves."""
    assert EXPORTED.keys() == KINDS.keys()


def test_all_files_appear_and_nothing_else(lamp: Path) -> None:
    names = {path.name for path in lamp.parent.iterdir()}
    assert names == {"lamp.plux", "lamp.ies", "lamp.shape.ies", "lamp.usda"}


def test_the_bundle_is_valid_and_complete(lamp: Path) -> None:
    opened = Bundle.open(lamp)
    assert set(opened.manifest.networks) == set(SIGNATURES)
    assert opened.manifest.name == "Test Lamp"
    assert opened.manifest.networks["sampler"].uniform_fraction == 0.05
    assert opened.manifest.fidelity["held_out_gain_nats"] == 1.5
    assert opened.manifest.provenance["scene"] == "lamp.xml"
    assert next(iter(opened.entries)) == "test_lamp.usda"
    assert opened.read("preview.png").startswith(b"\x89PNG")
    assert b"/home" not in opened.data


def test_a_verdict_is_exported_with_what_concerns_the_networks(
    run_directory: Path, tmp_path: Path
) -> None:
    """Into the manifest, without what is said of a fast map left out; and on the preview."""
    judged = shutil.copytree(run_directory, tmp_path / "run")
    metrics = json.loads((judged / "metrics.json").read_text())
    (judged / "metrics.json").write_text(json.dumps(metrics | {"verdict": FINE.to_json()}))
    export(judged, tmp_path / "all.plux")
    export(judged, tmp_path / "few.plux", networks=["sampler"])
    whole, few = (Bundle.open(tmp_path / f"{name}.plux") for name in ("all", "few"))
    assert read(whole.manifest.fidelity["verdict"]) == FINE
    assert read(few.manifest.fidelity["verdict"]) == replace(FINE, fast=None)
    assert whole.manifest.provenance["anchor"] == "none"
    with Image.open(io.BytesIO(whole.read("preview.png"))) as picture:
        assert picture.width == 256 < picture.height


def test_an_opaque_lamp_has_no_transparency(run_directory: Path, tmp_path: Path) -> None:
    opaque = shutil.copytree(run_directory, tmp_path / "run")
    (opaque / "networks" / "transparency.safetensors").unlink()
    export(opaque, tmp_path / "lamp.plux")
    networks = Bundle.open(tmp_path / "lamp.plux").manifest.networks
    assert set(networks) == set(SIGNATURES) - {"transparency"}


def test_the_golden_vectors_hold_in_the_runtime(lamp: Path) -> None:
    luminaire = Luminaire.open(lamp)
    for name in SIGNATURES:
        luminaire.network(name)
        vectors = luminaire.bundle.vectors(name)
        assert len(vectors) == golden.count(name)


def test_the_golden_vectors_find_a_wrong_host(lamp: Path) -> None:
    luminaire = Luminaire.open(lamp)
    for name, (inputs, outputs) in SIGNATURES.items():
        vectors = luminaire.bundle.vectors(name)
        swapped = {key: array[:, ::-1] for key, array in vectors.inputs.items()}
        result = luminaire.network(name)(swapped)
        for output in outputs:
            error = np.abs(result[output] - vectors.outputs[output])
            wrong = (error > vectors.tolerances[output]).reshape(len(vectors), -1).any(1)
            assert wrong.mean() > 0.5, (name, output, list(inputs))


def test_a_runtime_equals_the_trained_networks(lamp: Path, run_directory: Path) -> None:
    luminaire = Luminaire.open(lamp)
    student = RunDirectory.open(run_directory).network("student", Student)
    vectors = luminaire.bundle.vectors("appearance")
    with torch.no_grad():
        expected = student(*map(torch.tensor, vectors.inputs.values())).numpy()
    result = luminaire.radiance(*vectors.inputs.values())
    np.testing.assert_allclose(result, expected, rtol=1e-4, atol=1e-4 * expected.max())


def test_the_surface_carries_the_whole_flux(lamp: Path) -> None:
    opened = Bundle.open(lamp)
    total = opened.surface().triangle_flux.sum(0)
    np.testing.assert_allclose(total, opened.manifest.flux, rtol=1e-5)


def test_the_photometric_file_has_the_lumens(lamp: Path) -> None:
    flux = Bundle.open(lamp).manifest.flux
    file = IESFile.read(lamp.with_suffix(".ies"))
    assert file.photometry.total_optical_power() == pytest.approx(lumens(np.array(flux)), rel=0.01)


def test_the_usd_asset_names_the_bundle(lamp: Path) -> None:
    stage = Usd.Stage.Open(str(lamp.with_suffix(".usda")))
    (found,) = asset_layer.luminaires(stage)
    assert Path(found.bundle) == lamp
    assert found.digest == Bundle.open(lamp).digest
    shape = stage.GetPrimAtPath(found.fallback[0]).GetAttribute("inputs:shaping:ies:file").Get()
    assert Path(shape.resolvedPath) == lamp.with_suffix(".shape.ies")
    missing = UsdUtils.ComputeAllDependencies(str(lamp.with_suffix(".usda")))[2]
    assert not missing


def test_the_same_run_gives_the_same_bytes(lamp: Path, run_directory: Path, tmp_path: Path) -> None:
    export(run_directory, tmp_path / "lamp.plux", name="Test Lamp")
    assert (tmp_path / "lamp.plux").read_bytes() == lamp.read_bytes()


def test_a_bundle_of_less(run_directory: Path, tmp_path: Path) -> None:
    export(run_directory, tmp_path / "a.plux", networks=["fast_map"], compact=True)
    opened = Bundle.open(tmp_path / "a.plux")
    assert list(opened.manifest.networks) == ["appearance", "fast_map"]
    assert opened.manifest.provenance["precision"] == "compact"
    assert not [name for name in opened.entries if "sampler" in name or "transparency" in name]


def test_a_network_that_differs_is_not_written(
    run_directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = EXPORTED["transparency"]

    def wrong(network: torch.nn.Module, *, compact: bool = False) -> bytes:
        network.network[-1].bias.data += 0.05
        model = right.graph(network, compact=compact)
        network.network[-1].bias.data -= 0.05
        return model

    monkeypatch.setitem(EXPORTED, "transparency", replace(right, graph=wrong))
    with pytest.raises(PureLightError, match="transparency: the ONNX network differs"):
        export(run_directory, tmp_path / "lamp.plux")
    assert not list(tmp_path.iterdir())


def test_a_failing_write_leaves_the_old_files(
    lamp: Path, run_directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(lamp.parent, tmp_path, dirs_exist_ok=True)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(bundle.container, "write", full)
    status = cli.main([str(run_directory), "--output", str(tmp_path / "lamp.plux")])
    assert status == 2
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    ("run", "output", "message"),
    [
        ("nowhere", "lamp.plux", "run directory"),
        (".", "lamp.zip", ".plux"),
        (".", "/dev/null/lamp.plux", "cannot write"),
    ],
)
def test_faults_of_the_user_are_one_line(
    run_directory: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    run: str,
    output: str,
    message: str,
) -> None:
    status = cli.main([str(run_directory / run), "--output", str(tmp_path / output)])
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert status == 2
    assert error.startswith("purelight-export: error: ")
    assert message in error
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_refused_before_any_work(
    run_directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RunDirectory, "open", lambda path: pytest.fail("work has begun"))
    (tmp_path / "file").touch()
    with pytest.raises(PureLightError, match="name is that of a file"):
        export(run_directory, tmp_path / "file" / "lamp.plux")


def test_a_missing_folder_is_made_and_a_lamp_is_called_like_its_scene(
    run_directory: Path, tmp_path: Path
) -> None:
    config = RunDirectory(run_directory).config | {"luminaire": "/home/someone/desk lamp.xml"}
    run = RunDirectory(shutil.copytree(run_directory, tmp_path / "run"))
    run.write_json("config.json", config)
    export(run.path, tmp_path / "new" / "folder" / "out.plux", networks=["appearance"])
    opened = Bundle.open(tmp_path / "new" / "folder" / "out.plux")
    assert opened.manifest.name == "desk lamp"
    with pytest.raises(PureLightError, match="run directory"):
        export(tmp_path / "nowhere", tmp_path / "another" / "out.plux")
    assert not (tmp_path / "another").exists()


@pytest.fixture(scope="module")
def measured(
    run_directory: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[RunDirectory, Path]:
    """A run with figures in W, and its bundle."""
    folder = tmp_path_factory.mktemp("measured")
    run = RunDirectory(shutil.copytree(run_directory, folder / "run"))
    figures = {"flux_error": [0.3, 0.2, 0.1], "student_flux": [3.1, 2.0, 0.9]}
    spread = {"student_flux_error": [0.03, 0.02, 0.01], "held_out_gain_nats": 1.5}
    run.write_json("metrics.json", figures | spread)
    export(run.path, folder / "as traced.plux")
    return run, folder / "as traced.plux"


@pytest.mark.parametrize("factor", [2.0, 0.37, 1e-6, 1e6])
def test_a_lamp_of_so_many_lumens(
    measured: tuple[RunDirectory, Path], tmp_path: Path, factor: float
) -> None:
    run, path = measured
    traced = Luminaire.open(path)
    wanted = factor * lumens(traced.manifest.flux)
    export(run.path, tmp_path / "lamp.plux", lumens=wanted)
    scaled = Luminaire.open(tmp_path / "lamp.plux")
    assert validate(tmp_path / "lamp.plux").exit_code == 0
    before, after = traced.manifest, scaled.manifest
    assert lumens(after.flux) == pytest.approx(wanted, rel=1e-6)
    np.testing.assert_allclose(after.flux, np.multiply(before.flux, factor))
    np.testing.assert_allclose(after.radiance_scale, before.radiance_scale * factor)
    for key in ("flux_error", "student_flux", "student_flux_error"):
        np.testing.assert_allclose(after.fidelity[key], np.multiply(before.fidelity[key], factor))
    assert after.fidelity["held_out_gain_nats"] == 1.5
    assert after.provenance["lumens"] == wanted
    assert after.provenance["power_factor"] == pytest.approx(factor)
    assert "lumens" not in before.provenance
    surfaces = [luminaire.bundle.surface().triangle_flux for luminaire in (scaled, traced)]
    np.testing.assert_allclose(surfaces[0], surfaces[1] * factor, rtol=1e-6)


@pytest.mark.parametrize("compact", [False, True])
def test_the_light_of_every_network_is_scaled_and_nothing_else(
    measured: tuple[RunDirectory, Path], tmp_path: Path, compact: bool
) -> None:
    run, _ = measured
    factor, bundles = 3.7, []
    flux = run.description.flux
    for name, wanted in (("a", None), ("b", factor * lumens(flux))):
        export(run.path, tmp_path / f"{name}.plux", compact=compact, lumens=wanted)
        bundles.append(Luminaire.open(tmp_path / f"{name}.plux"))
    for name, (_, outputs) in SIGNATURES.items():
        inputs = bundles[0].bundle.vectors(name).inputs
        first, second = (luminaire.network(name)(inputs) for luminaire in bundles)
        golden = bundles[1].bundle.vectors(name).outputs
        for output in outputs:
            times = factor if output in ("radiance", "radiance_map") else 1.0
            np.testing.assert_allclose(second[output], times * first[output], rtol=2e-6)
            wanted = times * bundles[0].bundle.vectors(name).outputs[output]
            np.testing.assert_allclose(golden[output], wanted, rtol=2e-6)


def test_photometry_is_scaled(measured: tuple[RunDirectory, Path], tmp_path: Path) -> None:
    run, _ = measured
    arguments = [str(run.path), "--output", str(tmp_path / "lamp.plux"), "--lumens", "806"]
    assert cli.main([*arguments, "--networks", "appearance"]) == 0
    file = IESFile.read(tmp_path / "lamp.ies")
    assert file.photometry.total_optical_power() == pytest.approx(806, rel=0.01)


def test_a_lamp_without_light_cannot_have_lumens(
    run_directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = RunDirectory(shutil.copytree(run_directory, tmp_path / "run"))
    dark = {"flux": [0.0] * 3, "channels": [False] * 3}
    run.write_json("description.json", run.read_json("description.json") | dark)
    arguments = [str(run.path), "--output", str(tmp_path / "lamp.plux"), "--lumens", "806"]
    assert cli.main(arguments) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert "gives no light" in error
    assert not (tmp_path / "lamp.plux").exists()


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "bright"])
def test_lumens_are_a_number_above_zero(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        cli.main(["run", "--output", "lamp.plux", f"--lumens={text}"])
    assert f"{text}: give a number above 0" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["1e300", "1e-300"])
def test_lumens_that_no_bundle_can_hold_are_one_line(
    run_directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    output = str(tmp_path / "lamp.plux")
    assert cli.main([str(run_directory), "--output", output, "--lumens", text]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert f"--lumens {float(text):g}: " in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["two\nlines", "tab\t", "x" * 201, "no\xa0break"])
def test_a_name_that_no_manifest_takes_is_refused_before_any_work(
    run_directory: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setattr(RunDirectory, "open", lambda path: pytest.fail("work has begun"))
    output = str(tmp_path / "lamp.plux")
    assert cli.main([str(run_directory), "--output", output, "--name", name]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert "printable" in error


@pytest.mark.parametrize(
    ("scene", "name"),
    [("no\xa0break", "no break"), ("x" * 240, "x" * 200), ("C:\\lamps\\desk", "desk")],
)
def test_any_scene_gives_a_lamp_a_name(
    run_directory: Path, tmp_path: Path, scene: str, name: str
) -> None:
    run = RunDirectory(shutil.copytree(run_directory, tmp_path / "run"))
    run.write_json("config.json", run.config | {"luminaire": f"{scene}.xml"})
    export(run.path, tmp_path / "lamp.plux", networks=["appearance"])
    assert Bundle.open(tmp_path / "lamp.plux").manifest.name == name


def test_an_unknown_network_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        cli.main(["run", "--output", "lamp.plux", "--networks", "sampler,teacher"])
    assert caught.value.code == 2
    assert "teacher" in capsys.readouterr().err


@pytest.mark.parametrize("channels", [(True, False, False), (False, False, False)])
def test_lamps_without_some_channels(
    run_directory: Path, tmp_path: Path, channels: tuple[bool, bool, bool]
) -> None:
    shutil.copytree(run_directory, tmp_path / "run")
    run, present = RunDirectory(tmp_path / "run"), np.array(channels, np.float32)
    description = run.read_json("description.json")
    flux = [float(f * c) for f, c in zip(description["flux"], present, strict=True)]
    run.write_json("description.json", description | {"channels": channels, "flux": flux})
    for name, weights in (("escaped.npz", "weight"), ("surface.npz", "triangle_flux")):
        arrays = run.read_arrays(name)
        run.write_arrays(name, **(arrays | {weights: arrays[weights] * present}))
    export(run.path, tmp_path / "lamp.plux")
    luminaire = Luminaire.open(tmp_path / "lamp.plux")
    radiance = luminaire.radiance(*luminaire.bundle.vectors("appearance").inputs.values())
    np.testing.assert_array_equal(radiance.any(0), channels)
