"""Tasks of the benchmark of systems: where things stand, and figures of made-up pictures."""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.own.real import LightTracing, PathTracing
from benchmarks.systems.protocol import Subject
from benchmarks.systems.scales import ANY_LAMP, SCALES, scale
from benchmarks.systems.tasks import placing, views
from benchmarks.systems.tasks.floor import ALBEDO, Floor, cells, lux
from benchmarks.systems.tasks.glare import BACKGROUND, Glare, rating, weights
from benchmarks.systems.tasks.instances import Instances
from benchmarks.systems.tasks.room import Room
from benchmarks.systems.tasks.roughness import ALPHAS, BELOW, Roughness
from benchmarks.systems.tasks.task import JudgedTask
from benchmarks.systems.tasks.truth import Truth
from benchmarks.systems.tasks.views import View, sharpness
from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.scenes.lamp_choice import LampChoice, RealLamp, SphereLamp
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_train.light import radiance_field
from purelight_train.truth.metrics import Comparison
from purelight_train.truth.picture import Passes, Picture
from tests.unit.benchmarks.systems_twin import Noisy, subject

RADIANCE = 3.0
BALL = f"""<scene version="3.0.0"><shape type="sphere"><point name="center" value="0.1,0,-0.2"/>
  <float name="radius" value="0.05"/><bsdf type="diffuse"/>
  <emitter type="area"><rgb name="radiance" value="{RADIANCE},{RADIANCE},{RADIANCE}"/></emitter>
</shape></scene>"""
TASKS = [
    Room(12), Floor(2), Roughness(12), View("view_side", 35, 10, 12, 0.05),
    Glare("glare_near", -60, -35, 12, 0.05, 8), Instances(3, 12),
]  # fmt: skip


@pytest.fixture
def ball(tmp_path: Path) -> Subject:
    (tmp_path / "ball.xml").write_text(BALL)
    return subject(tmp_path)


def noisy(image: np.ndarray, noise: float = 0.01) -> Picture:
    rng, sums = np.random.default_rng(1), Passes()
    for _ in range(4):
        sums.add(image + noise * rng.standard_normal(image.shape))
    return sums.picture()


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_scenes_hold_the_lamp_about_the_origin(task: JudgedTask, ball: Subject) -> None:
    path = task.scene(ball, RealLamp(ball.scene), ball.run)
    scene = mi.load_file(str(path))
    lamps = [s for s in scene.shapes() if s.is_emitter()]
    assert len(lamps) == (3 if isinstance(task, Instances) else 1)
    if len(lamps) == 1:
        box = lamps[0].bbox()
        assert np.allclose(np.array(box.center()), 0, atol=1e-3 * placing.RADIUS)
        assert np.allclose(np.array(box.extents()), 2 * placing.RADIUS, rtol=1e-4)


@pytest.mark.parametrize("task", TASKS[:5], ids=lambda task: task.name)
def test_own_size_and_enlarged_look_alike(task: JudgedTask, ball: Subject) -> None:
    flux = RADIANCE * 4 * math.pi**2 * ball.radius**2
    sphere = SphereLamp((flux,) * 3, ball.radius)
    at_origin = replace(ball, centre=(0.0, 0.0, 0.0))
    images = [
        np.array(mi.render(mi.load_file(str(task.scene(s, lamp, s.run))), spp=512, seed=2))
        for s, lamp in ((ball, RealLamp(ball.scene)), (at_origin, sphere))
    ]  # fmt: skip
    assert images[0].mean() > 0
    assert images[1].mean() == pytest.approx(images[0].mean(), rel=0.03)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_roulette_begins_later_where_no_room_sends_light_back(
    task: JudgedTask, ball: Subject
) -> None:
    path = task.scene(ball, RealLamp(ball.scene), ball.scene.parent)
    integrator = ET.parse(path).getroot().find("integrator")
    assert integrator is not None
    depth = integrator.find("integer[@name='rr_depth']")
    assert depth is not None
    assert depth.get("value") == ("16" if task.name in {"floor", "roughness"} else "8")


def test_light_traced_truth_agrees_with_path_tracing(ball: Subject) -> None:
    task = Room(12)
    truth = task.truth(ball, ball.run / "truth", 1 << 18)
    frames = list(PathTracing().rendered(ball, task, ball.run, [64, 128], 1))
    assert frames[1].samples == 128
    assert frames[1].seconds > frames[0].seconds > 0
    told = noisy(frames[1].image, 0)
    mean = Comparison(told, truth.picture, truth.mask).errors()["mean"]
    assert 0.5 < truth.mask.mean() < 1
    assert abs(mean) < 0.02


def test_truth_of_a_view_is_the_balls_radiance(ball: Subject) -> None:
    view = View("view_side", 35, 10, 12, 0.05)
    truth = view.truth(ball, ball.run, 1 << 18)
    truth.save(ball.run / "truth.npz")
    again = Truth.load(ball.run / "truth.npz")
    inner = again.picture.image[4:8, 4:8]
    assert again.mask[4:8, 4:8].all()
    assert not again.mask[0, 0]
    assert inner.mean() == pytest.approx(RADIANCE, rel=0.02)
    seen = list(PathTracing().rendered(ball, view, ball.run, [16, 32], 1))[-1]
    assert np.abs(seen.image - again.picture.image)[again.mask].mean() < 0.1 * RADIANCE


def test_views_share_photons(ball: Subject) -> None:
    """Each picture is what it is alone, and of its own size; each has its part of the seconds."""
    view, eye = TASKS[3], Glare("glare_near", -60, -35, 16, 0.05, 8)
    found = view.truths([Room(12), view, eye], ball, ball.run, 1 << 19)
    assert list(found) == [view.name, eye.name]
    assert found[view.name].seconds == found[eye.name].seconds
    for task in (view, eye):
        alone, shared = task.truth(ball, ball.run, 1 << 19), found[task.name]
        assert np.array_equal(shared.mask, alone.mask)
        told = shared.picture.image[alone.mask]
        assert told == pytest.approx(alone.picture.image[alone.mask], rel=0.15)
        assert told.mean() == pytest.approx(alone.picture.image[alone.mask].mean(), rel=0.01)


def test_other_tasks_have_a_truth_of_their_own(ball: Subject) -> None:
    room = Room(12)
    assert list(room.truths([*TASKS[1:]], ball, ball.run / "truth", 1 << 18)) == [room.name]


def test_margin_is_that_of_the_truths_lens() -> None:
    assert views.MARGIN == radiance_field.MARGIN


def test_grid_of_the_standard() -> None:
    """Table A.1 of EN 12464-1 from 1 to 10 m and at 100 m, and the largest spacing, 10 m."""
    sides = (1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 100.0, 1000.0)
    assert [cells(side) for side in sides] == [5, 6, 8, 10, 13, 16, 20, 100]
    image = np.full((4, 4, 3), ALBEDO / math.pi)
    assert lux(image, 2) == pytest.approx(np.full((2, 2), 683.0))


def test_floor_tells_mean_and_uniformity(ball: Subject) -> None:
    image = np.ones((10, 10, 3))
    image[:2, :2] = 0.5
    truth = Truth(noisy(image), np.ones((10, 10), bool), 1, 0)
    found = Floor(2).figures(ball, noisy(1.1 * image, 0), truth)
    assert found["lux_error"] == pytest.approx(0.1, abs=0.01)
    assert found["uniformity"] == pytest.approx(0.5 / image.mean(), abs=0.01)
    assert found["lux_noise"] < 0.01
    dark = Truth(noisy(0 * image, 0), truth.mask, 1, 0)
    assert Floor(2).figures(ball, noisy(image), dark).keys() == {"lux", "true_lux"}


def test_rating_follows_luminance_solid_angle_and_position() -> None:
    camera = Glare("glare", 0, -30, 64, 0.0, 10).camera(BoundingSphere((0, 0, 0), 1.0))
    weight = weights(camera)
    side = 2 * math.atan(camera.half_width)
    plain = weights(Glare("glare", 0, 0, 64, 0.0, 10).camera(BoundingSphere((0, 0, 0), 1.0)))
    assert plain.sum() < side**2  # p is one on the line of sight alone, and grows
    assert weight.sum() < 0.3 * plain.sum()
    even = np.full((64, 64, 3), 1.0)
    told = rating((even, even), weight)
    assert told == pytest.approx(8 * math.log10(0.25 / BACKGROUND * 683**2 * weight.sum()))
    brighter = rating((2 * even, 2 * even), weight)
    assert brighter is not None
    assert told is not None
    assert brighter - told == pytest.approx(16 * math.log10(2))
    assert rating((0 * even, even), weight) is None


def test_noise_adds_nothing_to_a_rating() -> None:
    weight, rng = np.ones((64, 64)), np.random.default_rng(3)
    noisy_halves = [1 + rng.standard_normal((64, 64, 3)) for _ in range(2)]
    even = np.ones((64, 64, 3))
    told, true = rating((noisy_halves[0], noisy_halves[1]), weight), rating((even, even), weight)
    biased = rating((noisy_halves[0], noisy_halves[0]), weight)
    assert told == pytest.approx(true, abs=0.15)
    assert biased is not None
    assert true is not None
    assert biased - true > 1


def test_sharpness_is_one_for_the_truth_and_less_for_a_blur() -> None:
    rng = np.random.default_rng(4)
    image = rng.random((32, 32, 3))
    truth = Truth(noisy(image, 0.2), np.ones((32, 32), bool), 1, 0)
    blurred = sum(np.roll(image, k, 0) for k in (-1, 0, 1)) / 3
    assert sharpness(image, truth) == pytest.approx(1, abs=0.05)
    blur = sharpness(blurred, truth)
    assert blur is not None
    assert blur < 0.6
    assert sharpness(np.ones_like(image), truth) == pytest.approx(0, abs=1e-9)


def test_strips_are_those_that_the_camera_sees(ball: Subject) -> None:
    task = Roughness(48)
    strip = task.strips()
    assert set(strip.ravel()) == {-1, *range(len(ALPHAS))}
    scene = mi.load_file(str(task.scene(ball, RealLamp(ball.scene), ball.run)))
    grid = (np.stack(np.meshgrid(*2 * [np.arange(48)]), -1).reshape(-1, 2) + 0.5) / 48
    at = mi.Point2f(np.ascontiguousarray(grid.T, np.float32))
    ray, _ = scene.sensors()[0].sample_ray(0, 0.5, at, 0.5)
    hit = scene.ray_intersect(ray)
    x = np.array(hit.p.x).reshape(48, 48) / placing.RADIUS
    low = np.array(hit.p.z) < -0.99 * BELOW * placing.RADIUS
    seen = (np.array(hit.is_valid()) & low).reshape(48, 48)
    mask = task.mask(ball, scene)
    assert not (mask & ~seen).any()
    assert 0.9 * seen.sum() < mask.sum() < seen.sum()
    assert np.corrcoef(x[seen & (strip >= 0)], strip[seen & (strip >= 0)])[0, 1] > 0.95


def test_bias_is_told_strip_by_strip(ball: Subject) -> None:
    task = Roughness(48)
    strip, image = task.strips(), np.ones((48, 48, 3))
    told = image.copy()
    told[strip == 2] *= 1.3
    truth = Truth(noisy(image), np.ones((48, 48), bool), 1, 0)
    bias = task.figures(ball, noisy(told, 0), truth)["bias"]
    assert bias[2] == pytest.approx(0.3, abs=0.01)
    assert bias[0] == pytest.approx(0, abs=0.01)


def test_names_are_names_of_files_and_belong_to_one_task() -> None:
    for each in SCALES.values():
        names = [task.name for task in each.tasks(ANY_LAMP, 0.1)]
        assert len(set(names)) == len(names)
        assert all(name.replace("_", "").isalnum() for name in names)
        steps = each.samples
        assert all(b >= 2 * a for a, b in itertools.pairwise(steps))
    with pytest.raises(PureLightError, match="no scale"):
        scale("huge")


def test_a_lamp_is_looked_at_from_where_the_gallery_looks() -> None:
    """A downlight seen from above is dark, and its look would not be judged."""
    seen = {
        lamp: {task.name: task for task in SCALES["small"].tasks(lamp, 0.1)}["view_gallery"]
        for lamp in CATALOG
    }
    for lamp, view in seen.items():
        assert isinstance(view, View)
        known = CATALOG[lamp].azimuth, CATALOG[lamp].elevation
        assert (view.azimuth, view.elevation) == known


def test_a_system_refuses_what_it_cannot_show(ball: Subject) -> None:
    class Lit(MitsubaSystem):
        name, label, answers = "lit", "", ("illumination",)

        def lamp(self, subject: Subject, folder: Path) -> LampChoice:
            return RealLamp(subject.scene)

    with pytest.raises(PureLightError, match="cannot show appearance"):
        next(Lit().frames(ball, TASKS[3], ball.run, [1, 2], 1))
    assert "appearance" not in Noisy().answers
    assert LightTracing().prepare(ball, ball.run).megabytes > 0


def test_lamps_of_others_stay_as_large_as_they_are(ball: Subject) -> None:
    sphere = SphereLamp((1.0, 1.0, 1.0))
    assert placing.factor(ball, sphere) == 1
    assert placing.factor(ball, RealLamp(ball.scene)) == pytest.approx(400)
    assert isinstance(placing.elements(ball, sphere, ball.run)[0], ET.Element)
