"""Rays of a file as an emitter inside a lamp's optics."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import file_of
from purelight_format.ray_file.files import write_ray_file
from purelight_format.ray_file.rays import Rays
from purelight_mitsuba.platform import use
from tests.support.rays import disc

use()

from purelight_train.light import luminaire, visible_part  # noqa: E402
from purelight_train.light.exit_records import ExitRecords, settle  # noqa: E402
from purelight_train.light.light_tracing import trace_records  # noqa: E402
from purelight_train.light.luminaire import load_luminaire  # noqa: E402
from purelight_train.light.plugins import ray_file_plugin  # noqa: E402

LED = disc()
GLASS = '<bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf>'
BALL_LENS = f"""<shape type="sphere"><float name="radius" value="0.004"/>
    <point name="center" x="0" y="0" z="0.01"/>{GLASS}</shape>"""
DOME = f"""<shape type="sphere"><float name="radius" value="0.01"/>{GLASS}</shape>
    <shape type="sphere"><float name="radius" value="0.004"/>
    <boolean name="flip_normals" value="true"/>{GLASS}</shape>"""


@pytest.fixture(autouse=True)
def _few_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(luminaire, "VISIBILITY_RAYS", 1 << 16)
    monkeypatch.setattr(visible_part, "PER_TRIANGLE", (4, 16))


def scene(
    folder: Path, shapes: str, emitter: str = "", name: str = "led.tm25ray", rays: Rays = LED
) -> Path:
    """The LED in a scene."""
    write_ray_file(folder / "led.tm25ray", file_of(rays, "LED"))
    path = folder / "lamp.xml"
    path.write_text(
        f'<scene version="3.0.0"><emitter type="ray_file"><string name="filename" value="{name}"/>'
        f"{emitter}</emitter>{shapes}</scene>"
    )
    return path


def traced(folder: Path, shapes: str, rays: Rays = LED) -> ExitRecords:
    """Light that leaves the optics."""
    ray_file_plugin()
    return trace_records(mi.load_file(str(scene(folder, shapes, rays=rays))), 1, 0)


def test_clear_glass_passes_all_of_it_on(tmp_path: Path) -> None:
    records = traced(tmp_path, DOME)
    np.testing.assert_allclose(records.flux, LED.flux, rtol=0.01)
    assert records.flux[2] == 0  # A channel without light stays dark.
    assert records.needles == 0  # The LED has an area, so that no light is infinitely thin.
    assert not records.bare.any()


def test_measured_light_behind_clear_glass_raises_no_doubt(tmp_path: Path) -> None:
    """It comes from an area, though no shape has it."""
    from purelight_import.sanity import doubts

    ball = '<shape type="sphere"><float name="radius" value="0.03"/>' + GLASS + "</shape>"
    path = scene(tmp_path, ball, '<float name="flux" value="300"/>')
    assert doubts(load_luminaire(path).scene) == []


def test_powerful_rays_are_drawn_more_often(tmp_path: Path) -> None:
    """A thousandth of the rays with half of the power costs no noise."""
    power = LED.power.copy()
    power[::1000] *= 1000
    records = traced(tmp_path, DOME, Rays(LED.position, LED.direction, power))
    np.testing.assert_allclose(records.flux, power.sum(0), rtol=0.01)
    assert records.weight[:, 0].max() < 3 * records.weight[:, 0].mean()


def test_light_is_where_the_rays_are(tmp_path: Path) -> None:
    """Turned on its side, and moved; what meets nothing leaves by a hull around the rays."""
    turned = """<transform name="to_world"><rotate y="1" angle="90"/><translate x="0.1"/>
        </transform><float name="flux" value="100"/>"""
    mirror = '<shape type="sphere"><point name="center" x="0.1" y="0" z="-0.05"/>' \
        '<float name="radius" value="0.005"/><bsdf type="diffuse"/></shape>'  # fmt: skip
    found = load_luminaire(scene(tmp_path, mirror, turned))
    records = found.trace(1, 0)
    assert 683 * records.flux @ [0.2126, 0.7152, 0.0722] == pytest.approx(100, rel=0.02)
    settled, _ = settle(records, found.exit_surface)
    assert settled.flux[0] == pytest.approx(records.flux[0], rel=2e-3)
    bare = settled.take(settled.bare)
    assert bare.direction[:, 0].min() > -1e-6
    assert bare.direction[:, 0].mean() == pytest.approx(2 / 3, abs=0.01)  # Lambert's mean cosine.
    assert np.abs(bare.position[:, 0] - 0.1).max() < 1e-4
    virtual = found.exit_surface.virtual
    assert virtual is not None
    assert virtual.any()
    assert not virtual.all()


def test_light_beside_a_lens_leaves_by_a_hull(tmp_path: Path) -> None:
    found = load_luminaire(scene(tmp_path, BALL_LENS))
    records = found.trace(1, 0)
    assert 0.3 < records.bare.mean() < 0.95
    settled, _ = settle(records, found.exit_surface)
    np.testing.assert_allclose(settled.flux[:2], records.flux[:2], rtol=3e-3)


@pytest.mark.parametrize(
    ("emitter", "name", "message"),
    [("", "nowhere.tm25ray", "nowhere.tm25ray: cannot read"), ("", "lamp.xml", "not a ray file"),
     ('<float name="flux" value="-1"/>', "led.tm25ray", "flux must be a number"),
     ('<transform name="to_world"><scale x="2" y="1" z="1"/></transform>', "led.tm25ray",
      "to_world shears")],
)  # fmt: skip
def test_faults_are_one_line(tmp_path: Path, emitter: str, name: str, message: str) -> None:
    with pytest.raises(PureLightError, match=f"lamp.xml: .*{message}") as caught:
        load_luminaire(scene(tmp_path, DOME, emitter, name))
    assert "File" not in str(caught.value)
    assert "\n" not in str(caught.value)
