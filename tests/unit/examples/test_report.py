"""The report: one self-contained page whose figures are those of its pictures."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from purelight_examples import demo_report
from purelight_examples.stages import Record
from purelight_format.color import LUMINANCE
from purelight_format.measures import BoundingSphere
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.verdict.words import judge
from purelight_onnx.picture import write_exr
from purelight_train.report.grading import Grade, heat, white_balance
from purelight_train.report.page import Row, Shot, Table, write_page
from tests.support.verdicts import FINE

FLUX = (3.0, 1.2, 0.3)


def pixels(uri: str) -> np.ndarray:
    data = base64.b64decode(uri.removeprefix("data:image/png;base64,"))
    return np.asarray(Pillow.open(io.BytesIO(data)))


@pytest.fixture
def manifest() -> Manifest:
    networks = {"appearance": NetworkInfo("networks/appearance.onnx", 12_345, 4000, 900_000)}
    sphere = BoundingSphere((0.0, 0.0, 0.0), 0.07)
    return Manifest("lamp", sphere, FLUX, 100.0, 15.0, (True,) * 3, networks)


@pytest.fixture
def done(tmp_path: Path) -> dict[str, Record]:
    """Figures and tiny pictures: `fast` is 10 % too bright, everything else is exact."""
    rng = np.random.default_rng(0)
    exact = rng.uniform(0.5, 1.5, (24, 32, 3))
    noise = {"mape": 0.0123, "mape_blocks": 0.0067, "relative_mse": 0.0045}
    figures = {"seconds": 2.0, "spp": 64, "noise": noise}
    for name in demo_report.METHODS:
        write_exr(tmp_path / f"room_{name}.exr", exact * (1.1 if name == "fast" else 1))
    half = exact * rng.uniform(0.97, 1.03, exact.shape)
    write_exr(tmp_path / demo_report.HALF, half)
    for name in ("asset", "reference"):
        write_exr(tmp_path / f"lamp_{name}.exr", exact[:, :24])
    names = [*demo_report.METHODS, "plain", "view_reference"]
    records = {name: Record("", 2.0, figures) for name in names}
    records["train"] = Record("", 301.0, {"seconds": 300.0})
    records["export"] = Record("", 20.0, {"bytes": 2_500_000})
    return records


def test_page_shows_the_errors_of_its_pictures(
    tmp_path: Path, done: dict[str, Record], manifest: Manifest
) -> None:
    demo_report.write(tmp_path, "frosted_globe", done, manifest)
    page = (tmp_path / "report.html").read_text()
    assert "Frosted globe" in page
    for text in ("9.9 %", "0.0 %", "1.2 %", "0.7 %", "0.0045", "2.5 MB", "12,345", "5.0 min"):
        assert text in page, text
    links = re.findall(r'(?:src|href)="(?!data:)([^"]*)', page)
    assert links == ["lamp.html"]  # The lamp to walk around; all else is in the page
    assert (tmp_path / "room_accurate.png").is_file()
    assert (tmp_path / "lamp_asset.png").is_file()
    # Fast is brighter by 10 % and nothing else is off: each map has its own scale
    maps = page[page.index("Where the error is") :]
    assert re.findall(r"<span>\+(\d+) %</span>", maps) == ["2", "2", "10", "2"]
    means = [float(text) for text in re.findall(r"<dt>mean</dt><dd>(.*?) %", maps)]
    assert means[:3] == [0, 0, 9.9]
    assert abs(means[3]) < 0.5  # noise has no sign
    assert 'class="cover"' not in page


def test_the_lamps_verdict_comes_first(
    tmp_path: Path, done: dict[str, Record], manifest: Manifest
) -> None:
    judged = replace(manifest, fidelity={"verdict": FINE.to_json()})
    demo_report.write(tmp_path, "frosted_globe", done, judged)
    page = (tmp_path / "report.html").read_text()
    assert page.index(judge(FINE).caption) < page.index('class="wipe"')


def test_page_escapes_what_it_is_given(tmp_path: Path) -> None:
    row = Row("<b>", "&", [Shot("<i>", "data:,", {"<u>": '"'})])
    write_page(tmp_path / "page.html", "<title>", "<lead>", [row, Table("<h>", ["<a>"], [["<c>"]])])
    page = (tmp_path / "page.html").read_text()
    assert not re.findall(r"<(i|u|lead|a|c)>", page)


def test_white_balance_keeps_luminance_and_makes_the_lamp_whiter() -> None:
    gains = np.array(white_balance(FLUX))
    balanced = gains * FLUX
    assert LUMINANCE @ balanced == pytest.approx(LUMINANCE @ FLUX)
    assert balanced.max() / balanced.min() < max(FLUX) / min(FLUX)


def test_white_balance_of_a_red_lamp_is_finite() -> None:
    assert np.isfinite(white_balance((1.0, 0.0, 0.0))).all()


def test_heat_is_black_where_there_is_no_error_and_white_at_the_top() -> None:
    shown = pixels(heat(np.array([[0.0, 0.17, 0.5, 2.0]]), 0.5))[0]
    assert shown[0].tolist() == [0, 0, 0]
    assert shown[2].min() > 240
    assert shown[3].min() > 240
    assert shown[1, 0] > 200
    assert shown[1, 2] == 0


def test_grade_brightens_by_its_stops() -> None:
    image = np.full((2, 2, 3), 0.1)
    dark, bright = (pixels(Grade((1.0,) * 3, stops).uri(image)).mean() for stops in (0.0, 2.0))
    assert bright > dark + 50
