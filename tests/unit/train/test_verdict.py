"""The whole verdict: on a lamp whose networks are right, on wrong ones, and between its parts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from tests.support import tiny

RADIANCE = np.array([3.0, 2.0, 1.0], np.float32)
BALL = """<scene version="3.0.0"><shape type="sphere"><float name="radius" value="0.1"/>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
  <emitter type="area"><rgb name="radiance" value="3,2,1"/></emitter></shape></scene>"""
PLATES = """<scene version="3.0.0">
  <shape type="rectangle"><transform name="to_world"><scale value="0.5"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="3,2,1"/></emitter></shape>
  <shape type="rectangle">
    <transform name="to_world"><scale value="0.5"/><rotate x="1" angle="180"/>
      <translate z="1"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></shape>
</scene>"""


def even(position: Any, normal: Any, outgoing: Any) -> Any:
    """Of a ball that glows evenly."""
    return np.broadcast_to(RADIANCE, position.shape).copy()


def lopsided(position: Any, normal: Any, outgoing: Any) -> Any:
    """Brighter upwards than it is, and dimmer downwards."""
    return even(position, normal, outgoing) * (1 + 0.4 * outgoing[:, 2:])


@pytest.fixture(scope="module")
def load(mitsuba: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A scene's lamp, and rays to draw from."""
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import load_luminaire

    def make(scene: str) -> Any:
        path = tmp_path_factory.mktemp("lamp") / "lamp.xml"
        path.write_text(scene)
        luminaire = load_luminaire(path)
        surface = luminaire.exit_surface
        records = trace_records(luminaire.scene, 1, 5, surface=surface)
        return luminaire, ReferenceRays.of(surface, *settle(records, surface))

    return make


def found(lamp: Any, student: Any, fast_map: Any = None) -> Any:
    """The verdict on a radiance field, with the least effort."""
    from purelight_format.measures import cap, cap_to_direction
    from purelight_train.verdict.measure import Judge, Learned

    luminaire, references = lamp
    sphere = luminaire.exit_surface.sphere

    def sample(point: Any, u: Any) -> Any:
        seen = cap(point.astype(np.float64), sphere)
        return cap_to_direction(u.astype(np.float64), seen).astype(np.float32), 1 / seen.solid_angle

    learned = Learned(references, student, sample, fast_map)
    return Judge(luminaire.scene, sphere, learned, 1 << 18, 0).verdict()


@pytest.fixture(scope="module")
def ball(load: Any) -> Any:
    return load(BALL)


def even_map(sphere_part: float = 1.0) -> Any:
    return lambda point: np.broadcast_to(sphere_part * RADIANCE, (len(point), 16, 16, 3))


def test_the_right_networks_are_good(ball: Any) -> None:
    """All that is known of them: nothing is worse than noise allows."""
    verdict = found(ball, even, even_map())
    assert verdict.photons == 1 << 21
    assert verdict.accurate.within < verdict.accurate.noise
    assert verdict.accurate.mean == pytest.approx(0, abs=0.01)
    assert [verdict.share.below, verdict.share.around] == pytest.approx([0.25, 0.5], abs=0.01)
    assert verdict.near is None
    assert verdict.look is not None
    assert verdict.look.error < 0.03
    assert verdict.look.haze == 0
    assert verdict.fast is not None
    assert verdict.fast.within < 0.06
    told = judge(verdict)
    assert (told.look, told.fast) == ("crisp", True)
    assert told.light in ("good", "fair")  # Fair only by the noise of so little light.
    assert read(verdict.to_json()) is not None


def test_wrong_networks_are_not(ball: Any) -> None:
    verdict = found(ball, lopsided, even_map(1.3))
    assert verdict.accurate.within > 0.2
    assert verdict.accurate.zones.below == pytest.approx(-0.3, abs=0.04)
    assert verdict.accurate.zones.above == pytest.approx(0.3, abs=0.04)
    assert verdict.fast is not None
    assert verdict.fast.mean == pytest.approx(0.3, abs=0.02)
    told = judge(verdict)
    assert (told.light, told.look) == ("poor", "soft")
    assert "+3" in told.lines[0]
    assert "above it" in told.lines[0]


def test_a_seed_gives_the_same_verdict(ball: Any) -> None:
    assert found(ball, even).to_json() == found(ball, even).to_json()


def test_light_between_a_lamps_parts(load: Any) -> None:
    """Within the sphere of two plates, a place's light is its own, whatever else is right."""
    from purelight_train.verdict.near import Near

    luminaire, references = load(PLATES)
    surface = luminaire.exit_surface
    near = Near.of(surface, np.random.default_rng(0))
    assert near is not None
    inside = np.linalg.norm(near.centre - np.asarray(surface.sphere.center), axis=1)
    assert (inside < surface.sphere.radius).all()

    def true(position: Any, normal: Any, outgoing: Any) -> Any:
        """The lower plate's upper side, z = 0."""
        lit = (np.abs(position[:, 2]) < 0.1) & (normal[:, 2] > 0)
        return RADIANCE * lit[:, None].astype(np.float32)

    verdict = found((luminaire, references), true)
    assert verdict.near is not None
    assert verdict.near.within < max(0.1, verdict.near.noise)
    assert verdict.near.mean == pytest.approx(0, abs=0.05)
    bright = found((luminaire, references), lambda *q: 1.5 * true(*q))
    assert bright.near.within == pytest.approx(0.5, abs=0.1)


def test_places_are_outside_of_glass(load: Any, lamp: Path) -> None:
    """A ball has no place within its sphere where a table could be."""
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.verdict.near import Near

    closed = load_luminaire(lamp).exit_surface
    assert Near.of(closed, np.random.default_rng(0)) is None


def test_irradiance_of_a_place_is_what_crosses_it(load: Any) -> None:
    """Half a metre above a glowing square of one metre: a point's form factor (Howell, B-3)."""
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.verdict.near import Near

    luminaire, _ = load(PLATES)
    surface = luminaire.exit_surface
    centre, normal = np.array([[0.0, 0.0, 0.5]], np.float32), np.array([[0.0, 0.0, -1.0]])
    near = Near(surface, centre, normal.astype(np.float32), 0.05)
    records = trace_records(luminaire.scene, 1, 3, surface=surface)
    a = 1.0  # half a side over the distance
    quarter = a / math.sqrt(1 + a * a) * math.atan(a / math.sqrt(1 + a * a)) / math.pi
    expected = math.pi * RADIANCE * 4 * quarter
    np.testing.assert_allclose(near.caught(records)[0, 0], expected, rtol=0.04)

    def true(position: Any, normal: Any, outgoing: Any) -> Any:
        return RADIANCE * (np.abs(position[:, 2:]) < 0.1).astype(np.float32)

    told = near.of_student(true, np.random.default_rng(0))
    np.testing.assert_allclose(told.image[0, 0], expected, rtol=0.03)


def test_a_run_ends_with_its_verdict(
    lamp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In metrics.json, on the terminal and on the report's cover."""
    import purelight_train.cli
    from purelight_train.presets import PRESETS

    monkeypatch.setitem(PRESETS, "tiny", tiny.TINY)
    output = tmp_path / "run"
    words = ["--preset", "tiny", "--anchor", "none", "--device", "cpu", "--threads", "2"]
    assert purelight_train.cli.main([str(lamp), "--output", str(output), *words]) == 0
    import json

    metrics = json.loads((output / "metrics.json").read_text())
    verdict = read(metrics["verdict"])
    assert verdict is not None
    assert verdict.by_heart is None  # Photons are used once.
    assert metrics["seconds"]["verdict"] > 0
    out = capsys.readouterr().out.splitlines()
    told = judge(verdict, {"preset": "tiny", "anchor": "none"})
    assert out[: len(told.lines)] == list(told.lines)
    assert out[-1].startswith(f"{output}: flux ")
    assert out[-1].endswith("--output lamp.plux")
    page = (output / "report.html").read_text()
    assert told.caption in page
    assert page.count("% of white") >= 6


def test_what_a_teacher_knows_by_heart_is_told(lamp: Path, tmp_path: Path) -> None:
    metrics = tiny.train(lamp, tmp_path, judged=True)
    assert abs(metrics["verdict"]["by_heart"]) < 0.5
    without = tiny.train(lamp, tmp_path, resume=True)
    assert "verdict" not in without
