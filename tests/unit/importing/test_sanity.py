"""Each doubt about a lamp: a lamp that raises it, and one that does not."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from tests.support.lamp_files import mitsuba as writers
from tests.support.lamp_files import model
from tests.support.lamp_files.model import Piece

Maker = Callable[[], list[Piece]]


def piece(name: str, made: trimesh.Trimesh, **words: Any) -> Piece:
    return Piece(name, made, f"{name} paint", {"base": (0.5, 0.5, 0.5)} | words)


def glass(name: str, made: trimesh.Trimesh) -> Piece:
    return replace(model.globe(made, name), material=f"{name} glass")


def glow(made: trimesh.Trimesh, radiance: float = 100.0) -> Piece:
    return Piece("Bulb", made, "Glow", {"base": (0.0, 0.0, 0.0)}, (radiance,) * 3)


def moved(made: trimesh.Trimesh, x: float, z: float = 0.0) -> trimesh.Trimesh:
    made.apply_translation([x, 0, z])
    return made


def turned(made: trimesh.Trimesh) -> trimesh.Trimesh:
    made.invert()
    return made


def cup(radius: float) -> trimesh.Trimesh:
    made = model.ball(radius)
    made.update_faces(made.triangles_center[:, 2] < 0.5 * radius)
    return made


def scaled(pieces: list[Piece], factor: float) -> list[Piece]:
    """Larger, with the same flux."""
    made = []
    for p in pieces:
        p.mesh.apply_scale(factor)
        light = None if p.radiance is None else tuple(r / factor**2 for r in p.radiance)
        made.append(replace(p, radiance=light))
    return made


SOUND: dict[str, Maker] = {
    "a lamp": model.lamp,
    "a chandelier of 3 m": lambda: scaled(model.lamp(), 20),
    "a bulb under a shade": lambda: [glow(model.ball(0.02)), piece("Shade", cup(0.1))],
    "two bodies side by side": lambda: two_boxes(0.101),
    "a bead in a globe": lambda: [*model.lamp(), glass("Bead", moved(model.ball(0.01), 0.035))],
    "a wall of two parts": lambda: [
        model.bulb(), glass("Outer", model.ball(0.06)), glass("Inner", turned(model.ball(0.055))),
    ],
}  # fmt: skip
DOUBTFUL: dict[str, tuple[Maker, str]] = {
    "wrong units": (lambda: scaled(model.lamp(), 140), "m across.*--units"),
    "too small": (lambda: scaled(model.lamp(), 0.01), "mm across.*--units"),
    "too bright": (lambda: [glow(model.ball(0.02), 1e6)], "lm; if that is wrong.*--lumens"),
    "too dim": (lambda: [glow(model.ball(0.02), 1e-3)], "lm; if that is wrong.*--lumens"),
    "emitter turned in": (
        lambda: [glow(turned(model.ball(0.02))), piece("Foot", moved(model.ball(0.05), 0.2))],
        "no light of emitter 'Bulb'.*faces inwards",
    ),
    "emitter shut in": (
        lambda: [glow(model.ball(0.02)), piece("Box", model.ball(0.1))], "no light of emitter"
    ),
    "little light": (
        lambda: [glow(model.ball(0.02)), piece("Box", cup_almost_closed())],
        "only .* % of the light",
    ),
    "open glass": (lambda: [model.bulb(), glass("Cup", cup(0.06))], "'Cup' is open.*thin"),
    "glass inside out": (
        lambda: [model.bulb(), glass("Globe", turned(model.shell()))], "'Globe' is inside out"
    ),
    "overlapping glass": (
        lambda: [
            glow(moved(model.ball(0.02), 0, 0.3)), glass("A", model.ball(0.05)),
            glass("B", moved(model.ball(0.05), 0.04)),
        ],
        "'A' and 'B' overlap",
    ),
    "two bodies that touch": (lambda: two_boxes(0.1), "glass '.' touches other glass"),
    "a bulb in solid glass": (
        lambda: [model.bulb(), glass("Globe", model.ball(0.06))], "'Bulb' stands in solid glass"
    ),
}  # fmt: skip


def two_boxes(apart: float) -> list[Piece]:
    size = (0.1, 0.1, 0.1)
    boxes = [glass("A", model.box(size, (0, 0, 0))), glass("B", model.box(size, (apart, 0, 0)))]
    return [glow(moved(model.ball(0.02), 0, 0.3)), *boxes]


def cup_almost_closed() -> trimesh.Trimesh:
    made = model.ball(0.1, 4)
    made.update_faces(made.triangles_center[:, 2] < 0.0995)
    return made


def doubts(mi: Any, folder: Path, pieces: list[Piece], more: str = "") -> list[str]:
    from purelight_import.sanity import doubts as found

    path = writers.write(folder, pieces, more=more)
    return found(mi.load_file(str(path), optimize=False))


@pytest.mark.parametrize("name", SOUND)
def test_sound_lamps_raise_no_doubt(name: str, mitsuba: Any, tmp_path: Path) -> None:
    assert doubts(mitsuba, tmp_path, SOUND[name]()) == []


@pytest.mark.parametrize("name", DOUBTFUL)
def test_doubtful_lamps_raise_theirs_alone(name: str, mitsuba: Any, tmp_path: Path) -> None:
    make, words = DOUBTFUL[name]
    line, *others = doubts(mitsuba, tmp_path, make())
    assert all("touches" in other for other in others)  # of two, each says so
    assert re.search(words, line), line


@pytest.mark.parametrize(
    ("bsdf", "doubtful"),
    [("dielectric", True), ("thindielectric", True), ("roughdielectric", False)],
)
def test_point_lights_behind_glass(bsdf: str, doubtful: bool, mitsuba: Any, tmp_path: Path) -> None:
    point = '<emitter type="point" id="Spark"><rgb name="intensity" value="1"/></emitter>'
    rough = '<float name="alpha" value="0.4"/>' if bsdf.startswith("rough") else ""
    ball = f'<shape type="sphere"><float name="radius" value="0.1"/><bsdf type="{bsdf}">{rough}'
    found = doubts(mitsuba, tmp_path, [], f"{point}{ball}</bsdf></shape>")
    assert len(found) == doubtful
    if doubtful:
        assert "'Spark'" in found[0]
        assert "purelight-import" in found[0]


def test_light_that_leaves_is_counted_by_emitter(mitsuba: Any, tmp_path: Path) -> None:
    """A free ball sends all of its light out, one in a black box none."""
    from purelight_import.sanity.light import leaving
    from purelight_import.sanity.subject import Subject

    far = moved(model.ball(0.02), 1.0)
    pieces = [glow(model.ball(0.02)), Piece("Far", far, "Glow2", {"base": (0, 0, 0)}, (3, 2, 1)),
              piece("Box", model.ball(0.1))]  # fmt: skip
    path = writers.write(tmp_path, pieces)
    found = leaving(Subject(mitsuba.load_file(str(path), optimize=False)))
    area = np.pi * model.ball(0.02).area
    expected = [[100 * area] * 3, [3 * area, 2 * area, area]]
    np.testing.assert_allclose(found.emitted, expected, rtol=1e-4)
    np.testing.assert_allclose(found.left, [[0, 0, 0], expected[1]], rtol=0.02)


def test_a_painted_mesh_beside_a_point_light(mitsuba: Any, tmp_path: Path) -> None:
    """Mitsuba cannot draw rays of it, and asks it all the same when it draws those of a point."""
    mesh = mitsuba.Mesh("sign", 3, 1)
    parameters = mitsuba.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 1, 0, 0, 0, 1, 0]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    mesh.add_attribute("vertex_color", 3, [1.0] * 9)
    mesh.write_ply(str(tmp_path / "sign.ply"))
    paint = '<texture type="mesh_attribute" name="radiance"><string name="name" value="{}"/>'
    sign = (
        '<shape type="ply"><string name="filename" value="sign.ply"/><emitter type="area">'
        f"{paint.format('vertex_color')}</texture></emitter></shape>"
    )
    point = '<emitter type="point" id="Spark"><rgb name="intensity" value="1"/></emitter>'
    (tmp_path / "lamp.xml").write_text(f'<scene version="3.0.0">{sign}{point}</scene>')
    from purelight_import.sanity import doubts as doubts_of

    found = doubts_of(mitsuba.load_file(str(tmp_path / "lamp.xml")))
    assert any("'Spark'" in line for line in found)
