"""The training report: its figures are those of its pictures, and it stands alone."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image as Pillow

from purelight_format.measures import BoundingSphere

RADIANCE = np.array([3.0, 2.0, 1.0], np.float32)
SPHERE = BoundingSphere((0.0, 0.0, 0.0), 0.1)
METRICS: dict[str, Any] = {
    "flux": [1.0, 0.5, 0.0],
    "flux_error": [0.01, 0.01, 0.0],
    "flux_gain": [1.01, 0.99, 1.0],
    "student_flux": [1.0, 0.5, 0.0],
    "held_out_gain_nats": 1.25,
    "seconds": {"light": 4.0, "student": 96.0},
    "losses": {"student": [3.0, float("nan"), 0.125]},
    "skipped_steps": {"student": 0},
    "astray": {},
}


class Uniform:
    """A sampler that draws every direction of the cap alike."""

    def pdf_solid_angle(self, point: torch.Tensor, toward: torch.Tensor) -> torch.Tensor:
        distance = point.double().norm(dim=-1)
        one_minus_cos = 1 - torch.sqrt(1 - (SPHERE.radius / distance) ** 2)
        return 1 / (2 * torch.pi * one_minus_cos)


@pytest.fixture
def glowing(mitsuba: Any) -> dict[str, Any]:
    """A ball of one radiance, its surface, and that radiance as a field."""
    import trimesh

    from purelight_train.light.description import Description
    from purelight_train.light.exit_surface import ExitSurface

    ball = trimesh.creation.icosphere(subdivisions=4, radius=SPHERE.radius)
    surface = ExitSurface(
        ball.vertices.astype(np.float32),
        ball.faces.astype(np.uint32),
        np.zeros(len(ball.faces), bool),
    )
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": RADIANCE.tolist()}}
    scene = mitsuba.load_dict(
        {"type": "scene", "ball": {"type": "sphere", "radius": 0.1, "emitter": emitter}}
    )
    flux = tuple(float(x) for x in np.pi * surface.area * RADIANCE)
    description = Description(SPHERE, flux, (0.0,) * 3, 2.0, (True,) * 3, surface.area, 1)

    def radiance(position: Any, *_: Any) -> Any:
        return np.broadcast_to(RADIANCE, position.shape).copy()

    return {"description": description, "scene": scene, "surface": surface, "radiance": radiance}


def pixels(uri: str) -> Any:
    data = base64.b64decode(uri.removeprefix("data:image/png;base64,"))
    return np.asarray(Pillow.open(io.BytesIO(data)))


def test_views_measure_what_they_show(glowing: dict[str, Any]) -> None:
    """The right student has next to no error, one 20 % too bright has 20 %."""
    from purelight_train.report.views import LampViews
    from purelight_train.verdict.look import views

    right, sphere = glowing["radiance"], glowing["description"].sphere
    seen = views(glowing["scene"], sphere, glowing["surface"], right, 1 << 20, 1, 7)
    lamp = glowing["description"], glowing["surface"]
    rows = LampViews(*lamp, seen, teacher=lambda *q: 1.2 * right(*q)).rows()
    assert [row.heading for row in rows] == ["From the side", "From below", "From above"]
    for row in rows:
        reference, teacher, student, difference, noise_map = row.shots
        assert (reference.title, teacher.title, student.title) == (
            "Reference", "Teacher", "Student",
        )  # fmt: skip
        figures = [shot.figures for shot in (teacher, student)]
        off, noise = (float(f["error, noise taken out"].split()[0]) for f in figures)
        assert off == pytest.approx(20, abs=1.5)
        assert noise < 2
        assert float(figures[0]["brightness"].split()[0]) == pytest.approx(20, abs=1.5)
        assert pixels(teacher.uri)[64, 64].mean() > pixels(student.uri)[64, 64].mean()
        assert difference.scale.endswith("% of white")
        assert pixels(difference.uri)[64, 64].max() < 130  # next to none: near black
        assert noise_map.scale == difference.scale
        part = [float(s.figures["mean over the lamp"].split()[0]) for s in (difference, noise_map)]
        assert 0 < part[1] <= part[0] + 0.2  # the right student differs by the noise alone


def test_a_view_of_the_dark_side_has_no_relative_error(glowing: dict[str, Any]) -> None:
    """An opaque shade shows no light from above: nothing is divided by that."""
    from dataclasses import replace

    from purelight_train.report.views import LampViews
    from purelight_train.truth.picture import Picture
    from purelight_train.verdict.look import views

    sphere, surface = glowing["description"].sphere, glowing["surface"]
    seen = views(glowing["scene"], sphere, surface, glowing["radiance"], 1 << 16, 1, 7)
    black = Picture.exact(np.zeros_like(seen[2].truth.image))
    stray = Picture.exact(0.05 * seen[2].student.image)
    seen[2] = replace(seen[2], truth=black, student=stray)
    with np.errstate(all="raise"):
        rows = LampViews(glowing["description"], surface, seen).rows()
    assert "dark from here" in rows[2].shots[0].figures
    ((name, value),) = rows[2].shots[1].figures.items()
    assert name.startswith("brightness")
    assert float(value.split()[0]) == pytest.approx(7.5, abs=1)  # of a mean of two views in three
    assert "error, noise taken out" in rows[0].shots[1].figures


def test_differences_are_shown_with_their_sign_and_never_saturate() -> None:
    from purelight_train.report import difference

    apart = np.array([[-0.15, -0.05, 0.0, 0.05, 0.15]])
    scale = difference.shown_scale(apart)
    assert scale == 0.2
    red, _, blue = pixels(difference.shown(apart, scale))[0].astype(int).T
    assert (red[3:] > blue[3:] + 50).all()
    assert (blue[:2] > red[:2] + 50).all()
    assert max(red[2], blue[2]) < 30
    brightness = pixels(difference.shown(apart, scale))[0].sum(-1)
    assert brightness[0] > brightness[1] > brightness[2] < brightness[3] < brightness[4]
    assert difference.shown_scale(np.ones((2, 2))) == 1.0
    assert "linear-gradient" in difference.gradient()


def test_relative_errors_have_the_scale_that_they_need() -> None:
    from purelight_train.report import difference

    truth = np.full((40, 40, 3), 0.01)
    truth[20:] = 100.0  # an error of dark and of bright parts counts alike
    image = truth * 1.04
    error = difference.relative(image, truth)
    assert error[30, 0] == pytest.approx(0.04, rel=0.02)
    assert difference.relative_scale(error) == 0.05
    image[0, 0] = 50.0  # one firefly does not make the map black
    spiked = difference.relative(image, truth)
    assert difference.relative_scale(spiked) == 0.05
    assert pixels(difference.shown(spiked, 0.05))[30, 0, 0] > 180
    assert difference.relative_scale(np.full((4, 4), -3.0)) == 1.0
    black = np.zeros((4, 4, 3))
    assert np.isfinite(difference.relative(black, black)).all()


def test_the_verdict_comes_first(tmp_path: Path) -> None:
    from purelight_format.verdict.words import judge
    from tests.support.verdicts import FINE

    page = write(tmp_path, {**METRICS, "verdict": FINE.to_json()})
    told = judge(FINE)
    assert told.caption in page
    for line in told.lines:
        assert escape(line) in page
    assert page.index(told.caption) < page.index("Where the light went")


def test_cap_maps_compare_with_the_light(glowing: dict[str, Any]) -> None:
    from purelight_train.report.caps import POINTS, CapMaps

    def fast_map(point: torch.Tensor) -> torch.Tensor:
        return torch.from_numpy(RADIANCE).expand(len(point), 16, 16, 3)

    maps = CapMaps(
        glowing["description"], glowing["surface"], glowing["radiance"], Uniform(), fast_map
    )
    rows = maps.rows()
    assert [len(row.shots) for row in rows] == [len(POINTS)] * 5
    # A ball of one radiance fills the cap evenly, but for the edge of its tessellation
    for shot in rows[2].shots:
        assert int(re.findall(r"(\d+) %", shot.title)[0]) > 96
    for shot in rows[4].shots:
        assert abs(int(shot.figures["light"].split()[0])) < 6
        assert int(shot.figures["in other cells"].split()[0]) < 4


def write(folder: Path, metrics: dict[str, Any]) -> str:
    from purelight_train.light.description import Description
    from purelight_train.report.training import TrainingReport
    from purelight_train.runs.run_directory import RunDirectory

    run = RunDirectory(folder)
    run.write_json("metrics.json", metrics)
    config = {
        "luminaire": "C:\\lamps\\my_<lamp>.xml", "preset": {"name": "draft", "anchor": "none"},
        "route": "photons", "digest": "0" * 64, "seed": 0,
    }  # fmt: skip
    run.write_json("config.json", config)
    about = Description(SPHERE, (1.0, 0.5, 0.0), (0.0,) * 3, 1.0, (True, True, False), 0.1, 1)
    run.write_json("description.json", about.to_dict())
    run.save("student", torch.nn.Linear(1, 1), {})
    TrainingReport(run, []).write()
    return (folder / "report.html").read_text()


def test_page_stands_alone(tmp_path: Path) -> None:
    page = write(tmp_path, METRICS)
    for text in ("My &lt;lamp&gt;", "1.7 min", "+1.250 nats", "0.125", "1.0100", "Green"):
        assert text in page, text
    assert "Blue" not in page
    assert 'class="warning"' not in page
    assert "<svg" in page
    assert "nan" not in page
    assert not re.search(r'(src|href)="(?!data:)', page)


def test_page_warns(tmp_path: Path) -> None:
    bad = {"student_flux": [1.1, 0.5, 0.0], "skipped_steps": {"student": 3}, "dropped": 7,
           "astray": {"student": 900}}  # fmt: skip
    page = write(tmp_path, {**METRICS, **bad, "held_out_gain_nats": -0.5})
    for text in (
        "3 steps of the student",
        "900 steps of the student",
        "7 light paths",
        "10.0 %",
        "has not learned",
    ):
        assert text in page, text
    assert page.count('class="warning"') == 5


def test_a_lamp_thinner_than_a_pixel_has_figures_too(mitsuba: Any) -> None:
    """A wire of a metre: they were not numbers, and the whole verdict was lost with them."""
    import json

    from purelight_format.verdict import figures
    from purelight_train.light.description import Description
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.visible_part import visible_part
    from purelight_train.report.views import LampViews
    from purelight_train.verdict.look import Look, views
    from purelight_train.verdict.measure import looked_figures

    emitter = {"type": "area", "radiance": {"type": "rgb", "value": RADIANCE.tolist()}}
    for radius in (1e-3, 3e-4):
        wire = {
            "type": "cylinder", "p0": [-0.5, 0, 0], "p1": [0.5, 0, 0], "radius": radius,
            "emitter": emitter,
        }  # fmt: skip
        scene = mitsuba.load_dict({"type": "scene", "wire": wire})
        rng = np.random.default_rng(0)
        surface = visible_part(*scene_triangles(scene), 1 << 16, rng)
        flux = tuple(float(x) for x in np.pi * surface.area * RADIANCE)
        description = Description(
            surface.sphere, flux, (0.0,) * 3, 2.0, (True,) * 3, surface.area, 1
        )

        def radiance(position: Any, *_: Any) -> Any:
            return np.broadcast_to(RADIANCE, position.shape).copy()

        shown = views(scene, surface.sphere, surface, radiance, 1 << 18, 1, 0)
        found = looked_figures(Look(shown))
        assert found is not None
        assert all(np.isfinite(list(vars(found).values())))
        assert found.error < 0.5
        verdict = {
            "photons": 1, "accurate": {**dict.fromkeys(("within", "noise", "mean", "pattern"), 0),
                                       "zones": dict.fromkeys(figures.ZONES, 0)},
            "share": dict.fromkeys(figures.ZONES, 0), "pattern": 0, "look": vars(found),
        }  # fmt: skip
        assert figures.read(json.loads(json.dumps(verdict))) is not None
        page = "".join(row.html() for row in LampViews(description, surface, shown).rows())
        assert not re.search(r">nan\b", page)


def test_views_that_no_ray_of_a_picture_meets_are_left_out(glowing: dict[str, Any]) -> None:
    """As those of a string of tiny lights."""
    from purelight_train.report.views import TITLES, LampViews
    from purelight_train.verdict.look import views

    surface = glowing["surface"]
    seen = views(glowing["scene"], surface.sphere, surface, glowing["radiance"], 1 << 16, 1, 7)
    empty = [replace(view, mask=np.zeros_like(view.mask)) for view in seen]
    (row,) = LampViews(glowing["description"], surface, [*empty[:2], seen[2]]).rows()
    assert (row.heading, bool(row.text)) == (TITLES[2], True)
    assert LampViews(glowing["description"], surface, empty).rows() == []
