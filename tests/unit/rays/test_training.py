"""A lamp of measured rays from training to the bundle, and out of it as rays again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from purelight_export.export import export
from purelight_export.rays import traced_rays
from purelight_export.rays_cli import main
from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.light_distribution import bundle_photometry
from purelight_format.photometry.files import read_photometry
from purelight_format.ray_file.conversion import file_of, rays_of
from purelight_format.ray_file.files import read_ray_file, write_ray_file
from purelight_mitsuba.platform import use
from tests.support import tiny
from tests.support.rays import ball

use()

from purelight_train.cli import main as train  # noqa: E402
from purelight_train.light.measured_luminaire import load_measured  # noqa: E402
from purelight_train.presets import Optimisation  # noqa: E402
from purelight_train.report.training import write_report  # noqa: E402
from purelight_train.runs.pipeline import Training, reopen, start  # noqa: E402
from purelight_train.runs.run_directory import RunDirectory  # noqa: E402

SHORT = replace(tiny.TINY, photons=Optimisation(25, 1 << 11, 1e-2))
LAMP = ball(30_000)


def begin(folder: Path, **options: object) -> Training:
    lamp = folder / "ball.tm25ray"
    write_ray_file(lamp, file_of(LAMP, "Ball"))
    return start(
        lamp, folder / "run", SHORT, 0, "cpu", resume=False, route="photons",
        **options,  # type: ignore[arg-type]
    )  # fmt: skip


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run, its report, and a bundle with its photometry."""
    folder = tmp_path_factory.mktemp("measured")
    training = begin(folder)
    training()
    write_report(training)
    export(folder / "run", folder / "ball.plux", photometry=("ies", "ldt"))
    return folder


def test_metrics_and_report_tell_the_errors_of_the_count(trained: Path) -> None:
    metrics = json.loads((trained / "run" / "metrics.json").read_text())
    measured = metrics["measured"]
    assert (measured["rays"], measured["held_out_rays"]) == (30_000, 3000)
    assert measured["relative_error"]["flux"] == pytest.approx(30_000**-0.5, rel=0.01)
    assert measured["not_carried"] == ["transparency"]
    np.testing.assert_allclose(
        np.array(metrics["flux_error"]) / metrics["flux"], 27_000**-0.5, rtol=0.01
    )
    page = (trained / "run" / "report.html").read_text()
    assert "What the rays are worth" in page
    assert "30,000" in page


def test_the_bundle_says_what_it_does_not_carry(trained: Path) -> None:
    bundle = Bundle.open(trained / "ball.plux")
    assert "transparency" not in bundle.manifest.networks
    np.testing.assert_allclose(bundle.manifest.flux, [3, 2, 1], rtol=1e-3)
    assert bundle.manifest.provenance["measured"]["rays"] == 30_000
    assert bundle.manifest.provenance["measured"]["not_carried"] == ["transparency"]


def test_its_photometry_is_that_of_the_rays(trained: Path) -> None:
    for path in (trained / "ball.ies", trained / "ball.ldt"):
        assert read_photometry(path).table.flux == pytest.approx(LAMP.lumens, rel=2e-3)
    assert bundle_photometry(Bundle.open(trained / "ball.plux")).opening.shape == "ball"


def test_rays_of_the_bundle(trained: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = trained / "drawn.tm25ray"
    assert main([str(trained / "ball.plux"), "--count", "4000", "--output", str(out)]) == 0
    assert "4,000 rays" in capsys.readouterr().out
    rays = rays_of(read_ray_file(out))
    assert len(rays) == 4000
    assert rays.notes == ()
    np.testing.assert_allclose(rays.flux, [3, 2, 1], rtol=2e-3)
    light = rays.power @ LUMINANCE
    assert light.std() < light.mean()
    offset = rays.position - np.array([0.1, 0.2, 0.3])
    np.testing.assert_allclose(np.linalg.norm(offset, axis=1), 0.05, rtol=0.03)
    assert (np.einsum("nd,nd->n", offset, rays.direction) > 0).mean() > 0.99


def test_a_run_of_rays_has_a_file_already(
    trained: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(trained / "run"), "--output", str(trained / "x.sdf")]) == 2
    assert "was trained from rays, ball.tm25ray" in capsys.readouterr().err


def test_ray_files_are_converted_thinned_and_scaled(
    trained: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = str(trained / "ball.tm25ray"), trained / "some.sdf"
    assert main([source, "--output", str(out)]) == 0
    np.testing.assert_array_equal(
        read_ray_file(out).rows, read_ray_file(Path(source)).rows[:, :7]
    )  # fmt: skip
    assert main([source, "--count", "500", "--lumens", "806", "--output", str(out)]) == 0
    assert rays_of(read_ray_file(out)).lumens == pytest.approx(806, rel=1e-4)
    assert len(read_ray_file(out)) == 500
    assert main([source, "--output", str(trained / "x.txt")]) == 2
    assert "must end in" in capsys.readouterr().err


def test_an_exit_surface_is_for_rays_alone(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="has its own exit surface"):
        start(tiny.write(tmp_path), tmp_path / "run", SHORT, 0, "cpu", resume=False,
              exit_surface="tight")  # fmt: skip


def test_the_surface_around_rays_is_not_simplified(
    trained: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(trained / "ball.tm25ray"), "--output", str(trained / "simple"), "--device", "cpu"]
    assert train([*words, "--tolerance", "1e-3"]) == 2
    assert "leave --tolerance out" in capsys.readouterr().err
    assert not (trained / "simple").exists()


def test_a_run_goes_on_only_with_the_same_rays(trained: Path) -> None:
    write_ray_file(trained / "other.tm25ray", file_of(ball(30_000, seed=9), "Ball"))
    with pytest.raises(PureLightError, match="another digest"):
        start(trained / "other.tm25ray", trained / "run", SHORT, 0, "cpu", resume=True,
              route="photons")  # fmt: skip
    with pytest.raises(PureLightError, match="another exit_surface"):
        start(trained / "ball.tm25ray", trained / "run", SHORT, 0, "cpu", resume=True,
              route="photons", exit_surface="tight")  # fmt: skip


def test_traced_light_becomes_rays(trained: Path) -> None:
    """From one batch, and from several that are not all used."""
    luminaire = load_measured(trained / "ball.tm25ray")
    for count in (5000, 40_000):
        rays = traced_rays(luminaire, count, 1)
        assert len(rays) == count
        np.testing.assert_allclose(rays.flux, [3, 2, 1], rtol=2e-3)


def test_a_mesh_around_rays_is_known_by_its_place_and_its_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run is used from other folders too, and its networks fit no other surface."""
    globe = trimesh.creation.icosphere(2, radius=0.06)
    globe.apply_translation([0.1, 0.2, 0.3])
    globe.export(tmp_path / "globe.ply")
    monkeypatch.chdir(tmp_path)
    begin(tmp_path, exit_surface="globe.ply")
    config = json.loads((tmp_path / "run" / "config.json").read_text())
    assert config["exit_surface"] == str((tmp_path / "globe.ply").resolve())
    globe.apply_translation([0, 0, 0.001])
    globe.export(tmp_path / "globe.ply")
    options = {"resume": True, "route": "photons", "exit_surface": "globe.ply"}
    with pytest.raises(PureLightError, match="another surface_digest"):
        start(tmp_path / "ball.tm25ray", tmp_path / "run", SHORT, 0, "cpu", **options)  # type: ignore[arg-type]
    with pytest.raises(PureLightError, match=r"globe\.ply: is not what .*run was trained of"):
        reopen(RunDirectory(tmp_path / "run"), tmp_path / "ball.tm25ray")
