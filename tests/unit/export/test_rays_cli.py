"""`purelight-rays`: its arguments, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_export import rays
from purelight_export.graph import Graph
from purelight_export.rays_cli import main
from purelight_format import bundle
from purelight_format.measures import BoundingSphere
from purelight_format.members.surface import Surface
from purelight_format.ray_file.conversion import file_of
from purelight_format.ray_file.files import read_ray_file, write_ray_file
from tests.support import analytic_lamps, bundles, smallest
from tests.support.rays import ball


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "ball.tm25ray"
    write_ray_file(path, file_of(ball(5000), "Ball"))
    return path


@pytest.mark.parametrize(
    "words",
    [
        ("--seed", "-1"), ("--seed", "4294967296"), ("--seed", "one"), ("--count", "0.5"),
        ("--count", "0"), ("--lumens", "1e300"), ("--lumens", "1e-40"),
    ],
)  # fmt: skip
def test_a_number_of_no_use_is_one_line(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, str]
) -> None:
    output = tmp_path / "out.tm25ray"
    try:
        status = main([str(source), "--output", str(output), *words])
    except SystemExit as ended:
        status = int(ended.code or 0)
    assert status == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert words[0] in error
    assert not output.exists()


@pytest.mark.parametrize("suffix", ["tm25ray", "dat"])
def test_few_rays_have_the_flux_of_all(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    output = tmp_path / f"few.{suffix}"
    whole = read_ray_file(source)
    uneven = whole.rows.copy()
    uneven[:, 6:] *= np.linspace(0.1, 3, len(uneven), dtype=np.float32)[:, None]
    write_ray_file(source, replace(whole, rows=uneven, stated={}))
    assert main([str(source), "--output", str(output), "--count", "1e1"]) == 0
    assert "warning" not in capsys.readouterr().err
    few, every = read_ray_file(output), read_ray_file(source)
    assert len(few) == 10
    assert few.total("lumens") == pytest.approx(every.total("lumens"), rel=1e-5)


def test_a_bundle_whose_networks_are_dark_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And not searched for rays for ever."""
    graph = Graph("appearance")
    _, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    graph.output("radiance", graph.clip(graph.sum(normal * outgoing) * 0.0, 0.0, 1.0) * np.zeros(3))
    dark = replace(analytic_lamps.ball(), networks={"appearance": graph.to_bytes()})
    path = dark.write(tmp_path / "dark.plux")
    drawn, calls = rays._drawn, []

    def watched(*arguments: Any) -> Any:
        calls.append(arguments)
        assert len(calls) < 1000
        return drawn(*arguments)

    monkeypatch.setattr(rays, "_drawn", watched)
    assert main([str(path), "--output", str(tmp_path / "out.tm25ray"), "--count", "10"]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert "its networks give none of the light" in error


def test_triangles_without_area_send_no_rays(tmp_path: Path) -> None:
    """Valid ones: their vertices lie apart from the others', and some of the flux is theirs."""
    lost = np.array([[0.1, 0.1, 0.3], [0.2, 0.1, 0.3]], np.float32)
    triangles = np.vstack([smallest.TRIANGLES, [[4, 5, 5]]]).astype(np.uint32)
    flux = np.multiply.outer([0.45, 0.45, 0.1], smallest.FLUX).astype(np.float32)
    surface = Surface(np.vstack([smallest.CORNERS, lost]), triangles, flux)
    model = smallest.appearance()
    manifest, content = bundles.parts(
        surface, {"appearance": (model, smallest.golden(model))}, name="Lost", flux=smallest.FLUX,
        bounding_sphere=BoundingSphere((0.0, 0.0, 0.0), 0.75), radiance_scale=7 / 9, r_max=15.0,
        channels=(True, True, True),
    )  # fmt: skip
    path = tmp_path / "lost.plux"
    bundle.write(path, manifest, content)
    output = tmp_path / "lost.tm25ray"
    assert main([str(path), "--output", str(output), "--count", "500"]) == 0
    assert len(read_ray_file(output).rows) == 500
