"""The whole verdict: on a lamp whose networks are right, on wrong ones, and between its parts."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge

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


@pytest.fixture(scope="module")
def right(ball: Any) -> Any:
    """The verdict on the right networks."""
    return found(ball, even, even_map())


def test_the_right_networks_are_good(right: Any, ball: Any) -> None:
    """All that is known of them: nothing is worse than noise allows."""
    from purelight_train.verdict.measure import HEIGHT
    from purelight_train.verdict.shells import Shells

    verdict, sphere = right, ball[0].exit_surface.sphere
    assert verdict.photons == 1 << 21
    assert verdict.accurate.within < verdict.accurate.noise
    assert verdict.accurate.mean == pytest.approx(0, abs=0.01)
    below, above = (
        (Shells(sphere).height() < -HEIGHT).mean(),
        (Shells(sphere).height() > HEIGHT).mean(),
    )
    zones = [below, 1 - below - above]  # Of equal cells, whole ones
    assert zones == pytest.approx([0.25, 0.5], abs=0.03)
    assert [verdict.share.below, verdict.share.around] == pytest.approx(zones, abs=0.002)
    assert verdict.near is None
    assert verdict.look is not None
    assert verdict.look.error < 0.03
    assert verdict.look.haze == 0
    assert verdict.fast is not None
    assert verdict.fast.within < 0.06
    told = judge(verdict)
    assert told.fast
    assert told.look in ("crisp", "soft")  # Soft only by the noise of so little light,
    assert told.light in ("good", "fair")  # and so is fair.
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


def test_a_seed_gives_the_same_verdict(ball: Any, right: Any) -> None:
    assert found(ball, even, even_map()).to_json() == right.to_json()


def lower_plate(position: Any, normal: Any, outgoing: Any) -> Any:
    """The lower plate's upper side, z = 0, which alone glows."""
    lit = (np.abs(position[:, 2]) < 0.1) & (normal[:, 2] > 0)
    return RADIANCE * lit[:, None].astype(np.float32)


@pytest.fixture(scope="module")
def plates(load: Any) -> Any:
    """The two plates' surface, and a million paths of their light."""
    from purelight_train.light.light_tracing import trace_records

    surface, scene = load(PLATES)[0].exit_surface, load(PLATES)[0].scene
    return surface, trace_records(scene, 1, 3, surface=surface)


def test_light_between_a_lamps_parts(plates: Any) -> None:
    """Places within the sphere of two plates: the right networks are right, others are not."""
    from purelight_train.truth.picture import Picture
    from purelight_train.verdict import light
    from purelight_train.verdict.near import Near

    surface, records = plates
    near = Near.of(surface, np.random.default_rng(0))
    assert near is not None
    inside = np.linalg.norm(near.centre - np.asarray(surface.sphere.center), axis=1)
    assert (inside < surface.sphere.radius).all()
    true = Picture.exact(near.caught(records))
    told = near.of_student(lower_plate, np.random.default_rng(1))
    found = light.error(told, true)
    assert found.within < 0.1
    assert found.mean == pytest.approx(0, abs=0.02)
    bright = near.of_student(lambda *q: 1.5 * lower_plate(*q), np.random.default_rng(1))
    assert light.error(bright, true).within == pytest.approx(0.5, abs=0.1)


def test_places_are_outside_of_glass(load: Any, lamp: Path) -> None:
    """A ball has no place within its sphere where a table could be."""
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.verdict.near import Near

    closed = load_luminaire(lamp).exit_surface
    assert Near.of(closed, np.random.default_rng(0)) is None


def test_irradiance_of_a_place_is_what_crosses_it(plates: Any) -> None:
    """Half a metre above a glowing square of one metre: a point's form factor (Howell, B-3)."""
    from purelight_train.verdict.near import Near

    surface, records = plates
    centre, normal = np.array([[0.0, 0.0, 0.5]], np.float32), np.array([[0.0, 0.0, -1.0]])
    near = Near(surface, centre, normal.astype(np.float32), 0.05)
    quarter = math.atan(1 / math.sqrt(2)) / (math.pi * math.sqrt(2))
    expected = math.pi * RADIANCE * 4 * quarter
    np.testing.assert_allclose(near.caught(records)[0, 0], expected, rtol=0.04)
    told = near.of_student(lower_plate, np.random.default_rng(0))
    np.testing.assert_allclose(told.image[0, 0], expected, rtol=0.03)


def test_what_is_known_by_heart_is_told(ball: Any) -> None:
    """Light of which a student gives e times as much as of other light is likelier by one nat."""
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.runs.judging import by_heart

    luminaire, _ = ball
    records = trace_records(luminaire.scene, 1, 9).take(slice(1 << 12))
    up = records.direction[:, 2] > 0
    description = SimpleNamespace(flux=(1.0, 1.0, 1.0))
    lamp = SimpleNamespace(
        surface=luminaire.exit_surface, held_out=records.take(~up), description=description
    )
    trainer: Any = SimpleNamespace(route=SimpleNamespace(learned_from=records.take(up)), lamp=lamp)

    def student(position: Any, normal: Any, outgoing: Any) -> Any:
        return even(position, normal, outgoing) * np.exp((outgoing[:, 2:] > 0).astype(np.float32))

    assert by_heart(trainer, student) == pytest.approx(1, abs=1e-5)
    trainer.route.learned_from = None
    assert by_heart(trainer, student) is None
