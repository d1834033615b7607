"""Participating media are left out, and a warning says so, once for a scene."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.cli import main
from purelight_mitsuba.output import passes
from purelight_mitsuba.transport.media import MediaWarning, ignored
from tests.support import analytic_lamps as lamps

FOG: dict[str, Any] = {"type": "homogeneous", "sigma_t": 1.0, "albedo": 0.5}
SCENE = """<scene version="3.0.0">
<medium type="homogeneous" id="fog"/>
<sensor type="perspective" id="camera"><ref id="fog"/><film type="hdrfilm">
<integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>
<shape type="cube" id="hall"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<emitter type="purelight"><string name="filename" value="ball.plux"/></emitter></scene>
"""


def hall(index: int = 0, **media: Any) -> dict[str, Any]:
    return {"type": "cube", "id": f"hall{index}", "bsdf": {"type": "null"}, **media}


def scene(*halls: dict[str, Any]) -> mi.Scene:
    content = lamps.room(size=8) | {f"hall{index}": part for index, part in enumerate(halls)}
    return mi.load_dict(content | {"light": {"type": "point", "intensity": 1.0}})


def warned(scene: mi.Scene, *integrators: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for integrator in integrators:
            mi.render(scene, integrator=integrator, spp=1)
    return [str(w.message) for w in caught if w.category is MediaWarning]


def test_a_scene_is_warned_of_once() -> None:
    foggy = scene(hall(interior=FOG | {"id": "fog"}))
    ours = mi.load_dict({"type": "purelight"})
    (line,) = warned(foggy, ours, ours)
    assert "fog inside hall0" in line
    assert "volpath" in line
    assert "\n" not in line
    clear, smoky = scene(hall()), scene(hall(exterior=FOG | {"id": "smoke"}))
    assert warned(clear, ours) == []
    (line,) = warned(smoky, ours)
    assert "smoke outside hall0" in line


def test_other_integrators_say_nothing() -> None:
    foggy = scene(hall(interior=FOG))
    assert warned(foggy, mi.load_dict({"type": "volpath"})) == []


def test_media_of_groups_are_found_and_many_are_counted() -> None:
    group = {"type": "shapegroup", "inner": hall(interior=FOG | {"id": "fog"})}
    content = lamps.room(size=8) | {"group": group}
    instance = {"type": "instance", "of": {"type": "ref", "id": "group"}}
    assert "fog inside hall0" in ignored(mi.load_dict(content | {"instance": instance}))
    many = scene(*(hall(k, interior=FOG | {"sigma_t": 1.0 + k}) for k in range(5)))
    assert "and 2 more" in ignored(many)


def test_it_is_rendered_without_them(tmp_path: Path) -> None:
    lamp = {"type": "purelight", "filename": str(lamps.ball().write(tmp_path / "ball.plux"))}
    images = []
    for media in ({"interior": FOG}, {}):
        content = lamps.room(size=8) | {"lamp": lamp, "hall": hall(**media)}
        integrator = mi.load_dict({"type": "purelight"})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MediaWarning)
            image, _ = passes.render_passes(mi.load_dict(content), integrator, 4)
        images.append(image)
    np.testing.assert_array_equal(*images)


def test_the_command_warns_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lamps.ball().write(tmp_path / "ball.plux")
    path = tmp_path / "scene.xml"
    path.write_text(SCENE)
    assert main([str(path), "--output", str(tmp_path / "out.exr"), "--spp", "1"]) == 0
    lines = [x for x in capsys.readouterr().err.splitlines() if "participating" in x]
    (line,) = lines
    assert line.startswith("purelight-render: warning: ")
    assert "fog around camera, fog inside hall" in line
