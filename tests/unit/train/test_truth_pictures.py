"""Light-traced pictures: analytic ones come out right, and other integrators agree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere

RADIANCE = np.array([3.0, 2.0, 1.0])
SPHERE = BoundingSphere((0.1, -0.2, 0.3), 0.5)
EMITTER = {"type": "area", "radiance": {"type": "rgb", "value": RADIANCE.tolist()}}
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
BALL = {"type": "sphere", "radius": 0.3, "center": [0.1, -0.3, 0.3]}
SHELL = {"type": "sphere", "radius": 0.5, "center": [0.1, -0.2, 0.3]}
Image = NDArray[np.float64]


def lens(size: int = 16, aperture: float = 0.1, elevation: float = 25.0) -> Any:
    from purelight_train.truth.thin_lens import ThinLens

    return ThinLens(SPHERE, size, 35.0, elevation, aperture)


def met_ball(origin: Image, direction: Image) -> Image:
    """Whether rays meet the ball."""
    offset = origin - np.array(BALL["center"])
    along = np.einsum("nd,nd->n", offset, direction)
    return along**2 > (offset**2).sum(1) - BALL["radius"] ** 2


def met_disk(origin: Image, direction: Image) -> Image:
    """Whether rays meet a horizontal disk of radius 0.4 about the sphere's centre from above."""
    t = (SPHERE.center[2] - origin[:, 2]) / direction[:, 2]
    at = origin + t[:, None] * direction - np.array(SPHERE.center)
    return (at[:, 0] ** 2 + at[:, 1] ** 2 < 0.4**2) & (direction[:, 2] < 0)


def cover(view: Any, met: Any, rays: int = 64) -> Image:
    """Part of each pixel's rays that meet a shape: [size, size]."""
    rng = np.random.default_rng(0)
    pairs = (view.rays(rng) for _ in range(rays))
    return np.mean([met(*(x.astype(np.float64) for x in p)) for p in pairs], 0).reshape(
        view.size, view.size
    )


def scores(image: Image, error: Image, expected: Image, expected_error: Image) -> Image:
    """Differences in standard deviations, of 4x4 means: pixels of few photons are not normal."""
    assert image.shape == expected.shape

    def block(values: Image) -> Image:
        size = values.shape[0] // 4
        return values.reshape(size, 4, size, 4, 3).sum((1, 3))

    deviation = np.sqrt(block(error**2) + block(expected_error**2))
    lit = deviation > 0
    assert lit.sum() > 12
    np.testing.assert_allclose(block(image)[~lit], block(expected)[~lit], atol=0.02)
    return (block(image - expected)[lit]) / deviation[lit]


DISK = {"type": "disk", "emitter": EMITTER, "bsdf": BLACK}


def test_ball_and_disk_have_their_radiance(mitsuba: Any) -> None:
    """Area lights without and behind a null surface: joined to the lens, and caught by it."""
    from purelight_train.truth.light_traced import light_traced, sharp_share

    ball = {**BALL, "emitter": EMITTER, "bsdf": BLACK}
    null = {**SHELL, "radius": 0.45, "bsdf": {"type": "null"}}
    raised = mitsuba.ScalarTransform4f().translate(list(SPHERE.center)).scale(0.4)
    disk = {**DISK, "to_world": raised}
    for parts, met, share in (
        ({"ball": ball}, met_ball, 0.0),
        ({"disk": disk}, met_disk, 0.0),
        ({"ball": ball, "shell": null}, met_ball, 1.0),
    ):
        scene = mitsuba.load_dict({"type": "scene", **parts})
        assert sharp_share(scene) == pytest.approx(share, abs=1e-6)
        view = lens(aperture=0.2)
        picture = light_traced(scene, [view], 1 << 22)[0]
        part = cover(view, met)
        expected = part[..., None] * RADIANCE
        error = np.sqrt(part * (1 - part) / 64)[..., None] * RADIANCE
        z = scores(picture.image, picture.error, expected, error)
        assert np.sqrt(np.mean(z**2)) < 1.4, parts.keys()
        assert np.abs(z).max() < 5, parts.keys()
        assert picture.error[part > 0.9].mean() < 0.1


def test_noise_is_what_it_says(mitsuba: Any) -> None:
    """The spread of independent pictures is their standard error, and halves are independent."""
    from purelight_train.truth.light_traced import BATCH, light_traced

    scene = mitsuba.load_dict({"type": "scene", "b": {**BALL, "emitter": EMITTER, "bsdf": BLACK}})
    pictures = [light_traced(scene, [lens()], 4 * BATCH, seed)[0] for seed in range(4)]
    stack = np.stack([p.image for p in pictures])
    told = np.sqrt(np.mean([p.error**2 for p in pictures]))
    assert np.sqrt(stack.var(0, ddof=1).mean()) == pytest.approx(told, rel=0.1)
    for picture in pictures:
        np.testing.assert_allclose(np.mean(picture.halves, axis=0), picture.image, atol=1e-12)


def test_lenses_share_photons(mitsuba: Any) -> None:
    """A second lens changes neither the first's mean nor what it shows."""
    from purelight_train.truth.light_traced import light_traced

    scene = mitsuba.load_dict({"type": "scene", "b": {**BALL, "emitter": EMITTER, "bsdf": BLACK}})
    both = light_traced(scene, [lens(), lens(elevation=-60.0)], 1 << 20)
    alone = light_traced(scene, [lens(elevation=-60.0)], 1 << 20, seed=1)[0]
    z = scores(both[1].image, both[1].error, alone.image, alone.error)
    assert np.sqrt(np.mean(z**2)) < 1.4


MATERIALS: dict[str, dict[str, Any]] = {
    "rough": {"type": "roughdielectric", "alpha": 0.3, "int_ior": 1.5},
    "plastic": {
        "type": "plastic",
        "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.7, 0.8]},
    },
}


@pytest.mark.parametrize("material", MATERIALS)
def test_path_tracing_agrees(mitsuba: Any, material: str) -> None:
    """A ball in a rough glass shell; a plastic ball beside a bare lamp (mixed sharp and smooth)."""
    from purelight_train.truth.light_traced import light_traced
    from purelight_train.truth.views import path_traced

    bsdf = MATERIALS[material]
    lit = {**BALL, "radius": 0.2, "emitter": EMITTER, "bsdf": BLACK}
    if material == "rough":
        parts = {"outer": {**SHELL, "bsdf": bsdf}}
        parts["inner"] = {**SHELL, "radius": 0.45, "flip_normals": True, "bsdf": bsdf}
    else:
        parts = {"body": {**SHELL, "center": [0.2, 0.1, 0.2], "radius": 0.2, "bsdf": bsdf}}
    scene = mitsuba.load_dict({"type": "scene", "lit": lit, **parts})
    view = lens(aperture=0.05)
    light = light_traced(scene, [view], 1 << 20)[0]
    path = path_traced(scene, view, 1 << 9, passes=8)
    z = scores(light.image, light.error, path.image, path.error)
    assert np.sqrt(np.mean(z**2)) < 1.6
    assert np.abs(z).max() < 5.5
    mean = light.image.mean((0, 1)) / path.image.mean((0, 1))
    np.testing.assert_allclose(mean, 1, atol=0.03)


def test_particle_tracer_agrees(mitsuba: Any, lamp: Path) -> None:
    from purelight_train.truth.light_traced import light_traced
    from purelight_train.truth.thin_lens import ThinLens
    from purelight_train.truth.views import path_traced

    scene = mitsuba.load_file(str(lamp))
    view = ThinLens(BoundingSphere((0.0, 0.0, 0.0), 0.05), 16, 35.0, 10.0, 0.02)
    light = light_traced(scene, [view], 1 << 20)[0]
    particles = path_traced(scene, view, 1 << 11, passes=8, integrator="ptracer")
    z = scores(light.image, light.error, particles.image, particles.error)
    assert np.sqrt(np.mean(z**2)) < 1.5
    np.testing.assert_allclose(light.image.mean((0, 1)), particles.image.mean((0, 1)), rtol=0.02)


def test_field_view_is_the_same_camera(mitsuba: Any) -> None:
    """A constant field on a tessellated ball gives the analytic picture."""
    import trimesh

    from purelight_train.light.exit_surface import ExitSurface
    from purelight_train.truth.views import field_view

    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    points = (ball.vertices + np.array(BALL["center"])).astype(np.float32)
    surface = ExitSurface(points, ball.faces.astype(np.uint32), np.zeros(len(ball.faces), bool))
    view = lens()

    def radiance(position: Any, *_: Any) -> Any:
        return np.broadcast_to(RADIANCE.astype(np.float32), position.shape).copy()

    picture, mask = field_view(surface, radiance, view, 32, np.random.default_rng(1))
    part = cover(view, met_ball)
    np.testing.assert_allclose(picture.image.mean((0, 1)), part.mean() * RADIANCE, rtol=0.02)
    assert (mask == (part >= 0.5))[np.abs(part - 0.5) > 0.25].all()
    assert picture.image[part == 1] == pytest.approx(
        np.broadcast_to(RADIANCE, (int((part == 1).sum()), 3))
    )
