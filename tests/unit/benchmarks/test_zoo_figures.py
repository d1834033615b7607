"""What the zoo measures with: floors, panels, the sun, patches, and the sums made of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
import trimesh

from benchmarks.zoo.figures import near, scenes
from benchmarks.zoo.figures.enlarged import LIGHT_TRACING, PATH_TRACING
from benchmarks.zoo.figures.through import seen_through
from benchmarks.zoo.figures.views import side_by_side
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_train.light.exit_surface import inward_rays
from purelight_train.light.radiance_field import look
from purelight_train.truth.metrics import Comparison
from purelight_train.truth.picture import Passes, Picture
from purelight_train.truth.plane import Plane
from purelight_train.truth.thin_lens import ThinLens
from tests.support.fidelity import Subject, floor_irradiance, ies_lumens, traced_plane

SPHERE = BoundingSphere((0.0, 0.0, 0.0), 1.0)
BALL = {
    "type": "sphere", "radius": 0.1, "bsdf": {"type": "diffuse", "reflectance": 0.0},
    "emitter": {"type": "area", "radiance": 100.0},
}  # fmt: skip


def analytic(plane: Plane, at: np.ndarray) -> np.ndarray:
    """Irradiance of an even ball as that of a point, I cos / d²: [cells, cells] by [y, x]."""
    intensity = 100.0 * np.pi * 0.1**2
    axis = ((np.arange(plane.cells) + 0.5) / plane.cells - 0.5) * plane.side
    x, y = np.meshgrid(axis + plane.center[0], axis + plane.center[1])
    offset = np.stack((x, y, np.full_like(x, plane.center[2])), -1) - at
    distance = np.linalg.norm(offset, axis=-1)
    return intensity * -offset[..., 2] / distance**3


@pytest.mark.parametrize("integrator", [LIGHT_TRACING, PATH_TRACING])
def test_floor_of_a_ball_is_that_of_the_formula(integrator: dict[str, Any]) -> None:
    """Beside the middle, so that swapped or turned axes would show."""
    at = np.array([1.0, -0.5, 0.2])
    plane = Plane((0.3, 0.2, -4.0), 8.0, 8)
    lamp = BALL | {"to_world": mi.ScalarTransform4f().translate(at.tolist())}
    told = floor_irradiance({"lamp": lamp}, integrator, plane, 1 << 14)
    true = analytic(plane, at)
    np.testing.assert_allclose(told.mean(-1), true, rtol=0.05)
    assert told.mean() == pytest.approx(true.mean(), rel=0.01)


def test_floor_of_our_own_tracer_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.support.fidelity.CHUNK", 1 << 20)
    plane = Plane((0.0, 0.0, -4.0), 8.0, 4)
    scene = mi.load_dict({"type": "scene", "lamp": BALL})
    told, error = traced_plane(scene, plane, 1 << 21, 5)
    apart = told.mean(-1) / analytic(plane, np.zeros(3)) - 1
    relative = error.mean(-1) / told.mean(-1)
    assert (relative < 0.02).all()
    assert (np.abs(apart) < 5 * relative + 0.06).all()  # cells are not small


SKIN = {"type": "mask", "opacity": 0.5, "bsdf": {"type": "diffuse", "reflectance": 0.9}}
STAIN = {
    "type": "homogeneous", "albedo": 0.0,
    "sigma_t": {"type": "rgb", "value": [0.5, 0.25, 0.0]},
}  # fmt: skip
GLASS = {"type": "dielectric", "int_ior": 1.5}
FRESNEL = (1 - 0.04) ** 2  # of both faces, upright


@pytest.mark.parametrize(
    ("lamp", "middle"),
    [
        ({"type": "sphere", "bsdf": SKIN}, (0.25, 0.25, 0.25)),
        ({"type": "sphere", "bsdf": {"type": "conductor"}}, (0.0, 0.0, 0.0)),
        ({"type": "sphere", "bsdf": GLASS, "interior": STAIN},
         tuple(FRESNEL * np.exp(-2 * np.array([0.5, 0.25, 0.0])))),
    ],
    ids=["skin", "mirror", "stained glass"],
)  # fmt: skip
def test_background_through_the_middle_of_a_ball(
    lamp: dict[str, Any], middle: tuple[float, float, float]
) -> None:
    """Reflections do not count but inside, where they come out behind; the corners are bare."""
    lens = ThinLens(SPHERE, 16, 35.0, 10.0, 1e-4)
    picture = seen_through({"lamp": lamp}, lens, 512)
    assert picture.image[7:9, 7:9].mean((0, 1)) == pytest.approx(middle, abs=0.04)
    np.testing.assert_allclose(picture.image[0, 0], 1.0)
    assert picture.halves[0] is not picture.halves[1]


def test_rim_of_glass_shows_no_reflections() -> None:
    """At grazing angles all light is reflected; a mirror's rim would show the background."""
    lens = ThinLens(SPHERE, 64, 0.0, 0.0, 1e-4)
    rows = [seen_through({"lamp": {"type": "sphere", "bsdf": b}}, lens, 64).image[32, :, 0]
            for b in (GLASS, {"type": "conductor"})]  # fmt: skip
    assert (rows[1] < 1).sum() > 50
    assert rows[1][rows[1] < 1].max() < 0.9  # but for pixels that the edge cuts
    assert rows[0][32] > rows[0][6]


def test_sun_alone_lights_a_floor_evenly() -> None:
    plane = Plane((0.0, 0.0, -2.0), 2.0, 4)
    aside = {"type": "sphere", "radius": 0.3, "center": [2.0, 0, 0]}
    told = floor_irradiance({"lamp": aside} | scenes.sun(), LIGHT_TRACING, plane, 1 << 14)
    np.testing.assert_allclose(told, 1.0, atol=0.1)
    assert told.mean() == pytest.approx(1.0, abs=0.02)


def test_places_are_outside_all_bodies() -> None:
    rod = {"type": "cylinder", "radius": 0.1, "p0": [0, 0, -1.0], "p1": [0, 0, 1.0]}
    found = [place for place, _ in zip(near.places({"rod": rod}, SPHERE), range(6), strict=False)]
    assert len(found) == 6
    for place in found:
        away = np.hypot(*place.at[:2])
        assert abs(away - 0.1) > 1.4 * place.half
        assert np.linalg.norm(place.at) <= 1
        assert np.dot(place.normal[:2], -place.at[:2]) > 0  # faces the rod
    assert not list(near.places({"ball": {"type": "sphere"}}, SPHERE))


def test_patch_measures_what_arrives() -> None:
    """A ball's light on patches that face it."""
    for at in (np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])):
        objects = scenes.patch(at, -at, 0.05)
        told = scenes.passes(objects | {"lamp": BALL}, LIGHT_TRACING, 1 << 18)
        true = 100.0 * np.pi * 0.1**2 * scenes.PATCH_ALBEDO / np.pi
        assert told.image.mean() == pytest.approx(true, rel=0.05)


def test_a_place_between_parts_of_a_lamp_shadows_none_of_them() -> None:
    """What a disc sends back from above a ball, by the light tracer's pane and the path tracer's
    meter; a dark square would keep the ball's light from the disc."""
    at, up = np.array([0.0, 0.0, 0.3]), np.array([0.0, 0.0, 1.0])
    above = mi.ScalarTransform4f().translate([0, 0, 0.6]).rotate([1, 0, 0], 180).scale(0.3)
    white = {"type": "diffuse", "reflectance": 0.8}
    lamp = {"lamp": BALL, "disc": {"type": "disk", "to_world": above, "bsdf": white}}
    seen, shadowed = (
        scenes.of_patch(scenes.passes(probe(at, up, 0.1) | lamp, LIGHT_TRACING, 1 << 20))
        for probe in (scenes.pane, scenes.patch)
    )
    true = scenes.passes(scenes.meter(at, up, 0.1) | lamp, PATH_TRACING, 1 << 18)
    noise = np.hypot(scenes.noise(seen), scenes.noise(true))
    assert noise < 0.02
    assert seen.image.mean() / true.image.mean() == pytest.approx(1, abs=4 * noise)
    assert shadowed.image.mean() < 0.7 * true.image.mean()


def test_passes_end_early_once_they_know_enough() -> None:
    objects = scenes.patch(np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0]), 0.05)
    sure = scenes.passes(objects | {"lamp": BALL}, PATH_TRACING, 1 << 12, 32, goal=0.5)
    assert 0 < scenes.noise(sure) < 0.5
    black = scenes.passes(objects, PATH_TRACING, 1 << 6, 32, goal=0.1)
    assert not black.image.any()
    assert scenes.noise(black) == 0


def flat(level: float, spread: float, seed: int, size: int = 16) -> Picture:
    rng, sums = np.random.default_rng(seed), Passes()
    for _ in range(4):
        sums.add(level + spread * rng.normal(size=(size, size, 3)))
    return sums.picture()


def test_near_figures_leave_out_what_is_not_known() -> None:
    place = near.Place(np.array([0.5, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), 0.1)
    sure = near.compared(flat(1.1, 0.01, 1), flat(1.0, 0.01, 2), place, SPHERE)
    assert sure["mean"] == pytest.approx(0.1, abs=0.01)
    assert sure["radii"] == 0.5
    vague = near.compared(flat(5.0, 9.0, 3, 2), flat(1.0, 3.0, 4, 2), place, SPHERE)
    assert vague["noise"] > near.KNOWN
    figures = near.summary([sure, vague], dark=2)
    assert figures["known"] == 1
    assert figures["absolute"] == pytest.approx(abs(sure["mean"]))
    assert "mean" not in near.summary([vague], dark=0)


def test_a_dark_view_counts_beside_the_lit_ones() -> None:
    """Haze in a view from behind a shade is measured by the whole lamp's radiance."""
    truth = side_by_side([flat(1.0, 0.0, 0), flat(0.0, 0.0, 0)])
    hazy = side_by_side([flat(1.0, 0.0, 0), flat(0.01, 0.0, 0)])
    assert truth.image.shape == (16, 32, 3)
    figures = Comparison(hazy, truth, np.ones((16, 32), bool)).to_dict()
    assert figures["mape_without_noise"] == pytest.approx(0.5 * 0.01 / 0.005, rel=1e-6)
    assert all(np.isfinite(value) for value in figures.values())


class Bundle:
    """What `Subject` asks of a bundle for its surface."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self.bundle = self
        self.positions = np.asarray(mesh.vertices, np.float32)
        self.triangles = np.asarray(mesh.faces, np.uint32)

    def surface(self) -> Bundle:
        return self


@pytest.mark.parametrize(("mesh", "sides"), [
    (trimesh.creation.icosphere(subdivisions=3), 1),
    (trimesh.creation.annulus(1e-3, 1.0, 1e-9, sections=64), 2),
], ids=["ball", "sheet"])  # fmt: skip
def test_flux_of_sheets_is_that_of_both_sides(mesh: trimesh.Trimesh, sides: int) -> None:
    if sides == 2:  # one face of the thin disk
        mesh.update_faces(mesh.face_normals[:, 2] > 0.5)
    subject = Subject(Path(), Path(), Path())
    subject.__dict__["luminaire"] = Bundle(mesh)
    origin, direction = inward_rays(SPHERE, 1 << 18, np.random.default_rng(0), cosine=True)
    seen = look(subject.surface, lambda position, *_: np.ones_like(position), origin, direction)
    told = (2 * np.pi * 1.0001 * SPHERE.radius) ** 2 * seen.mean()
    assert told == pytest.approx(sides * np.pi * mesh.area, rel=0.01)


def test_lumens_of_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match=r"gone\.ies: no such file"):
        ies_lumens(tmp_path / "gone.ies")
