"""Mitsuba's scenes: files that they name, found where they say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from purelight_import.formats import read
from purelight_import.importing import import_lamp

pytestmark = pytest.mark.usefixtures("at_once")
BULB = ('<shape type="sphere" id="bulb"><emitter type="area"><rgb name="radiance" value="1"/>'
        "</emitter></shape>")  # fmt: skip
BOX = '<shape type="cube" id="box"><transform name="to_world"><translate z="4"/></transform>'


def scene(folder: Path, body: str) -> Path:
    path = folder / "shelf.xml"
    path.write_text(f'<scene version="3.0.0">{body}</scene>')
    return path


def test_spectra_of_metals_come_along(mitsuba: Any, tmp_path: Path) -> None:
    (tmp_path / "metal").mkdir()
    (tmp_path / "metal" / "eta.spd").write_text("400 1.2\n550 1.1\n700 1.0\n")
    named = "".join(f'<spectrum name="{n}" filename="metal/eta.spd"/>' for n in ("eta", "k"))
    body = f'{BULB}{BOX}<bsdf type="conductor">{named}</bsdf></shape>'
    made = import_lamp(scene(tmp_path, body), tmp_path / "out", picture=False)
    assert made.scene.read_text().count('filename="textures/eta.spd"') == 2
    assert (tmp_path / "out" / "textures" / "eta.spd").read_text().startswith("400 1.2")
    assert mitsuba.load_file(str(made.scene))


def test_included_files_may_be_named_by_a_parameter(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(f'<scene version="3.0.0">{BULB}</scene>')
    body = '<default name="f" value="part"/><include filename="$f.xml"/>'
    assert [p.name for p in read(scene(tmp_path, body)).parts] == ["bulb"]


def test_paths_are_searched(tmp_path: Path) -> None:
    (tmp_path / "sub" / "tex").mkdir(parents=True)
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "sub" / "tex" / "t.png")
    (tmp_path / "sub" / "part.xml").write_text(f'<scene version="3.0.0">{BULB}</scene>')
    picture = (
        '<bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
        '<string name="filename" value="tex/t.png"/></texture></bsdf>'
    )
    body = f'<path value="sub"/><include filename="part.xml"/>{BOX}{picture}</shape>'
    made = import_lamp(scene(tmp_path, body), tmp_path / "out", picture=False)
    assert (tmp_path / "out" / "textures" / "t.png").is_file()
    assert {row["name"] for row in made.parts} == {"bulb", "box"}


def test_an_alias_is_another_name(tmp_path: Path) -> None:
    body = (
        '<bsdf type="dielectric" id="one"/><alias id="one" as="two"/><alias id="two" as="three"/>'
        f'{BULB}{BOX}<ref id="three"/></shape>'
    )
    assert read(scene(tmp_path, body)).parts[1].material.name == "one"


@pytest.mark.parametrize("more", ['folder="{0}"', ""])
def test_no_file_outside_is_read(more: str, tmp_path: Path, fault: Any) -> None:
    """Not by words either that the reader uses itself, nor by a path."""
    (tmp_path / "inner").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "t.png")
    string = f'<string name="filename" value="t.png" {more.format(tmp_path)}/>'
    body = f'<path value=".."/>{BOX}<bsdf type="diffuse"><texture type="bitmap" '
    body += f'name="reflectance">{string}</texture></bsdf></shape>{BULB}'
    assert "t.png: no such file" in fault(scene(tmp_path / "inner", body))
