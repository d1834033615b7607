"""Mitsuba's scenes: to which side emitters shine, and with what colour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.formats import read
from purelight_import.model.lamp import Part
from purelight_import.model.picture import Picture

pytestmark = pytest.mark.usefixtures("at_once")
PANEL = '<shape type="{kind}" id="led">{more}<emitter type="area">{value}</emitter></shape>'
GLOW = '<rgb name="radiance" value="10"/>'
TABLE = "400 1\n500 2\n700 3\n"


def write(folder: Path, body: str, version: str = "3.0.0") -> Path:
    path = folder / "shelf.xml"
    path.write_text(f'<scene version="{version}">{body}</scene>')
    return path


def led(folder: Path, value: str, kind: str = "disk", more: str = "") -> Part:
    (part,) = read(write(folder, PANEL.format(kind=kind, value=value, more=more))).parts
    return part


def loaded(mitsuba: Any, value: str) -> list[float]:
    """The radiance that Mitsuba itself gives an emitter."""
    text = PANEL.format(kind="disk", value=value, more="")
    scene = mitsuba.load_string(f'<scene version="3.0.0">{text}</scene>')
    found = mitsuba.traverse(scene.emitters()[0])["radiance.value"]
    return np.broadcast_to(np.array(found).ravel(), 3).tolist()


@pytest.mark.parametrize("kind", ["disk", "rectangle"])
@pytest.mark.parametrize(("flag", "up"), [("true", -1), ("True", -1), ("false", 1)])
def test_a_flipped_emitter_shines_down(kind: str, flag: str, up: int, tmp_path: Path) -> None:
    more = f'<boolean name="flip_normals" value="{flag}"/>'
    part = led(tmp_path, GLOW, kind, more)
    assert (up * part.mesh.cross[:, 2] > 0).all()


@pytest.mark.parametrize(
    "spectrum",
    [
        '<spectrum name="radiance" type="irregular"><string name="wavelengths" '
        'value="400, 550, 700"/><string name="values" value="1, 2, 3"/></spectrum>',
        '<spectrum name="radiance" type="regular"><float name="wavelength_min" value="400"/>'
        '<float name="wavelength_max" value="700"/><string name="values" value="1, 2, 3"/>'
        "</spectrum>",
        '<spectrum name="radiance" value="400:1, 550:2, 700:3"/>',
    ],
)
def test_spectra_have_the_colour_that_mitsuba_gives_them(
    spectrum: str, mitsuba: Any, tmp_path: Path
) -> None:
    wanted = loaded(mitsuba, '<spectrum name="radiance" value="400:1, 550:2, 700:3"/>')
    np.testing.assert_allclose(led(tmp_path, spectrum).radiance, wanted, rtol=1e-5)


@pytest.mark.parametrize(
    ("inner", "wanted"),
    [
        ("", (1, 1, 1)), ('<float name="scale" value="3"/>', (3, 3, 3)),
        ('<rgb name="color" value="1, 2, 3"/><float name="scale" value="2"/>', (2, 4, 6)),
    ],
)  # fmt: skip
def test_daylight_is_white(inner: str, wanted: tuple[float, ...], tmp_path: Path) -> None:
    value = f'<spectrum name="radiance" type="d65">{inner}</spectrum>'
    assert led(tmp_path, value).radiance == wanted


@pytest.mark.parametrize("version", ["3.0.0", "0.6.0"])
def test_a_spectrum_in_a_file(version: str, mitsuba: Any, tmp_path: Path) -> None:
    (tmp_path / "led.spd").write_text(TABLE)
    value = '<spectrum name="radiance" filename="led.spd"/>'
    path = write(tmp_path, PANEL.format(kind="disk", value=value, more=""), version)
    wanted = loaded(mitsuba, '<spectrum name="radiance" value="400:1, 500:2, 700:3"/>')
    np.testing.assert_allclose(read(path).parts[0].radiance, wanted, rtol=1e-5)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ('<texture name="radiance" type="checkerboard"/>', "as checkerboard is not taken"),
        ('<spectrum name="radiance" filename="none.spd"/>', "none.spd: no such file"),
        ('<spectrum name="radiance" type="irregular"><string name="values" value="1, 2"/>'
         "</spectrum>", "lacks wavelengths"),
    ],
)  # fmt: skip
def test_emission_that_is_not_taken(value: str, words: str, tmp_path: Path, fault: Any) -> None:
    assert words in fault(write(tmp_path, PANEL.format(kind="disk", value=value, more="")))


@pytest.mark.parametrize(
    ("version", "move"),
    [
        ("3.0.0",
         '<transform name="to_uv"><scale x="0.25"/><translate y="0.1"/></transform>'),
        ("0.6.0", '<float name="uscale" value="0.25"/><float name="voffset" value="0.1"/>'),
    ],
)  # fmt: skip
def test_a_glowing_bitmap_keeps_its_place(
    version: str, move: str, mitsuba: Any, tmp_path: Path
) -> None:
    pixels = np.zeros((16, 16, 3), np.uint8)
    pixels[:, :8] = 255
    Image.fromarray(pixels).save(tmp_path / "glow.png")
    string = '<string name="filename" value="glow.png"/>'
    value = f'<texture name="radiance" type="bitmap">{string}{move}</texture>'
    path = write(tmp_path, PANEL.format(kind="rectangle", value=value, more=""), version)
    radiance = read(path).parts[0].radiance
    assert isinstance(radiance, Picture)
    np.testing.assert_allclose(radiance.to_uv, [[0.25, 0, 0], [0, 1, 0.1], [0, 0, 1]], atol=1e-6)
    np.testing.assert_allclose(radiance.at(np.array([[0.9, 0.5]])), 1)
