"""Two distributions beside each other, on the command line and in a picture."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from purelight_format import bundle
from purelight_format.cli import inspect_main
from purelight_format.members import PHOTOMETRY
from purelight_format.photometry.comparison import Comparison
from purelight_format.photometry.eulumdat_writer import eulumdat_text
from purelight_format.photometry.figures import Figures
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.luminous_part import luminous_opening
from purelight_format.photometry.opening import BALL, BOX, DRUM, POINT, Opening
from purelight_format.photometry.polar_plot import polar_plot
from purelight_format.photometry.table import IntensityTable
from tests.support import lamp as octahedron
from tests.support.distributions import FULL, VERTICAL, ies, lambertian, lamp, skewed

PANEL = Opening(0.6, 0.6)


def test_figures_of_a_panel() -> None:
    figures = Figures.of(lambertian(1000, PANEL).table)
    assert figures.flux == pytest.approx(1000, rel=2e-3)
    assert figures.peak == pytest.approx(1000 / np.pi)
    assert figures.toward == (0, 0)
    assert figures.beam["C0-C180"] == pytest.approx(120, abs=0.5)
    assert figures.field["C90-C270"] == pytest.approx(2 * np.degrees(np.arccos(0.1)), abs=0.5)
    assert figures.downward == pytest.approx(1)


def test_figures_of_a_bare_bulb_and_of_none() -> None:
    even = IntensityTable(VERTICAL, np.zeros(1), np.ones((1, 37)))
    assert Figures.of(even).beam["C0-C180"] == 360
    assert Figures.of(even).downward == pytest.approx(0.5)
    dark = Figures.of(even.scaled(0))
    assert (dark.flux, dark.peak, dark.beam["C0-C180"], dark.downward) == (0, 0, 0, 0)


def test_figures_find_a_tilted_beam() -> None:
    row = np.interp(VERTICAL, [0, 30, 40, 50, 180], [0, 0, 100, 0, 0])
    rows = np.where(FULL[:, None] == 90, row, 0)
    figures = Figures.of(IntensityTable(VERTICAL, FULL, rows))
    assert figures.toward == (40, 90)
    assert figures.beam["C90-C270"] == pytest.approx(10)
    assert figures.beam["C0-C180"] == 0


def test_differences() -> None:
    same = Comparison(lamp(), lamp())
    assert same.rms() == 0
    brighter = Comparison(replace(lamp(), table=skewed().scaled(1.1)), lamp())
    assert brighter.rms() == pytest.approx(0.1)
    assert brighter.rms(same_flux=True) == pytest.approx(0, abs=1e-12)
    assert "+10.00 %" in brighter.to_text()


def test_a_turned_lamp_is_told() -> None:
    rows = skewed().candela[:-1]
    turned = np.roll(rows, 6, 0)  # What was at C0 is at C90.
    table = IntensityTable(VERTICAL, FULL, np.concatenate([turned, turned[:1]]))
    comparison = Comparison(lamp(), replace(lamp(), table=table))
    assert comparison.better_turned == 90
    assert "turned by 90 degrees" in comparison.to_text()
    assert Comparison(lamp(), lamp()).better_turned == 0


def test_against_a_dark_reference() -> None:
    dark = replace(lamp(), table=skewed().scaled(0))
    comparison = Comparison(lamp(), dark)
    assert json.loads(json.dumps(comparison.to_json(), allow_nan=False))["rms"] is None
    comparison.to_text()


def test_a_picture_holds_both_lamps() -> None:
    names = ("<script>&\n", "b" * 200)
    text = polar_plot([replace(lamp(), name=name) for name in names])
    root = ElementTree.fromstring(text)
    polygons = root.findall(".//{http://www.w3.org/2000/svg}polygon")
    assert len(polygons) == 4
    assert "<script>" not in text
    polar_plot([replace(lamp(), table=skewed().scaled(0))])


def test_openings_of_meshes() -> None:
    import trimesh

    box = trimesh.creation.box((0.2, 0.4, 0.1))
    ball = trimesh.creation.icosphere(3, 0.5)
    drum = trimesh.creation.cylinder(0.3, 0.2)
    for mesh, shape in ((box, BOX), (ball, BALL), (drum, DRUM)):
        lit = np.ones((len(mesh.faces), 3))
        found = luminous_opening(mesh.vertices, mesh.faces, lit)
        assert found.shape == shape
        size = np.ptp(mesh.vertices, axis=0)
        assert (found.width, found.length, found.heights[0]) == pytest.approx(tuple(size), 0.02)
    below = box.face_normals[:, 2] < -0.5
    panel = luminous_opening(box.vertices, box.faces, np.where(below[:, None], [1, 1, 1], 0))
    assert (panel.width, panel.length, panel.heights) == (0.2, 0.4, (0.0,) * 4)
    assert luminous_opening(box.vertices, box.faces, np.zeros((12, 3))) == POINT


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bundles with photometry and without, and photometric files, in one folder."""
    folder = tmp_path_factory.mktemp("lamps")
    table = skewed()
    (folder / "lamp.ies").write_text(ies(table))
    manifest, members = octahedron.parts()
    bundle.write(folder / "lamp.plux", manifest, members | {PHOTOMETRY: ies(table).encode()})
    bare = {name: data for name, data in members.items() if name != PHOTOMETRY}
    bundle.write(folder / "bare.plux", manifest, bare)
    other = LampPhotometry("Other\x1b[31m", table.scaled(1.02), PANEL)
    (folder / "other.ldt").write_bytes(
        eulumdat_text(other, maker="x", issued="2026-01-01", size=(1, 1, 1))
    )
    return folder


def test_the_command_compares(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = files / "polar.svg"
    arguments = [str(files / "lamp.plux"), "--compare", str(files / "other.ldt")]
    assert inspect_main([*arguments, "--plot", str(picture)]) == 0
    text = capsys.readouterr().out
    assert "-1.96 %" in text
    assert "RMS difference 1.96 %" in text
    ElementTree.parse(picture)
    assert inspect_main([*arguments, "--json", "--ugr"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["comparison"]["rms"] == pytest.approx(0.02 / 1.02, rel=1e-3)
    assert len(found["ugr"]["endwise"]) == 19


def test_the_command_says_what_a_file_holds(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert inspect_main([str(files / "other.ldt")]) == 0
    text = capsys.readouterr().out
    assert "lm" in text
    assert "\x1b" not in text
    assert inspect_main([str(files / "other.ldt"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["opening"]["width"] == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["lamp.ies", "--compare", "nowhere.ldt"], "nowhere.ldt: cannot read"),
     (["lamp.plux", "--compare", "lamp.xml"], "lamp.xml"),
     (["bare.plux", "--ugr"], "carries no photometry.ies"),
     (["lamp.ies", "--plot", "picture.png"], "must end in .svg")],
)  # fmt: skip
def test_faults_are_one_line(
    files: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(files)
    assert inspect_main(arguments) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert message in err
