"""What Cycles shows of a lamp, pixel by pixel, and the light that it gives a floor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.measures import cap, cap_to_direction
from purelight_onnx.luminaire import Luminaire
from tests.support import blender_lamps
from tests.support.analytic_lamps import CENTRE, RADIUS, Lamp
from tests.support.blender_host import Blender
from tests.unit.blender.conftest import pixels

ASKEW = np.array([[0, -1.5, 0, 0.2], [1.5, 0, 0, -0.1], [0, 0, 1.5, 0.4], [0, 0, 0, 1.0]])
# The lamp hangs turned, so that one of the two sees a ball behind the other.
ALONG_X = np.array([[0, 0, 1, 3], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
ALONG_Y = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
BACKGROUND, SIZE, PIXELS = 0.8, 0.9, 32


def steps(lamp: Path, name: str, world: np.ndarray, camera: np.ndarray, **more: Any) -> list[Any]:
    seen = camera.copy()
    return [
        ("empty", {"background": BACKGROUND}),
        ("plux", {"path": str(lamp)}),
        ("place", {"name": name, "world": world.tolist()}),
        ("picture", {"camera": seen.tolist(), "size": SIZE, "pixels": PIXELS, **more}),
    ]


def facing(world: np.ndarray, camera: np.ndarray) -> np.ndarray:
    """The camera moved aside so that it looks at the lamp's centre."""
    moved, centre = camera.copy(), (world @ [*CENTRE, 1])[:3]
    moved[:3, 3] = centre + 3 * camera[:3, 2]
    return moved


@pytest.mark.parametrize(
    ("lamp", "name"),
    [
        (blender_lamps.two_balls(), "two_balls"),
        (blender_lamps.two_balls(opaque=True), "two_opaque"),
        (blender_lamps.glass_ball(), "glass_ball"),
    ],
    ids=["two_balls", "two_opaque", "glass_ball"],
)
def test_a_lamp_is_seen_once_however_often_a_ray_crosses_it(
    lamp: Lamp, name: str, blender: Blender, tmp_path: Path
) -> None:
    path = lamp.write(tmp_path / f"{name}.plux")
    asked, cameras = [], [facing(ASKEW, turned) for turned in (np.eye(4), ALONG_X, ALONG_Y)]
    for number, camera in enumerate(cameras):
        asked += steps(path, name, ASKEW, camera, path=str(tmp_path / f"{number}.exr"))
    blender.run(*asked)
    opened = Luminaire.open(path)
    for number, camera in enumerate(cameras):
        expected = blender_lamps.view(opened, ASKEW, camera, SIZE, PIXELS, BACKGROUND)
        found = pixels(tmp_path / f"{number}.exr")
        known = np.isfinite(expected).all(-1) & (expected != BACKGROUND).any(-1)
        assert known.sum() > 50
        near = np.isclose(found, expected, rtol=2e-3, atol=1e-3).all(-1)
        assert near[known].mean() > 0.98, number  # Rounding may choose a neighbour's normal.
        outside = (expected == BACKGROUND).all(-1)
        assert np.allclose(found[outside], BACKGROUND, rtol=1e-4)


def test_one_lamp_is_seen_through_another(blender: Blender, tmp_path: Path) -> None:
    """Behind a first lamp a second one keeps its light: dimmed, and through the first."""
    path = blender_lamps.glass_ball().write(tmp_path / "ball.plux")
    behind = np.eye(4)
    behind[2, 3] = -1.0
    camera = facing(np.eye(4), np.eye(4))
    shot = {"camera": camera.tolist(), "size": SIZE, "pixels": PIXELS}
    blender.run(
        ("empty", {"background": BACKGROUND}), ("plux", {"path": str(path)}),
        ("plux", {"path": str(path)}),
        ("place", {"name": "ball", "world": np.eye(4).tolist()}),
        ("place", {"name": "ball.001", "world": behind.tolist()}),
        ("dim", {"name": "ball", "dimmer": 0.25}),
        ("dim", {"name": "ball.001", "dimmer": 2.0, "tint": [1, 0.5, 0]}),
        ("picture", {"path": str(tmp_path / "both.exr"), **shot}),
    )  # fmt: skip
    opened = Luminaire.open(path)
    light = blender_lamps.view(opened, np.eye(4), camera, SIZE, PIXELS)
    known = np.isfinite(light).all(-1) & light.any(-1)
    passed = np.array(blender_lamps.THROUGH)
    second = 2.0 * np.array([1, 0.5, 0]) * light + passed * BACKGROUND
    expected = 0.25 * light + passed * second
    near = np.isclose(pixels(tmp_path / "both.exr"), expected, rtol=3e-3, atol=1e-3).all(-1)
    assert near[known].mean() > 0.98


@pytest.mark.parametrize("opaque", [False, True])
def test_a_floor_has_the_light_that_the_networks_give_it(
    opaque: bool, blender: Blender, tmp_path: Path
) -> None:
    """Of two balls that stand in each other's light, on and beside the axis."""
    path = blender_lamps.two_balls(opaque=opaque).write(tmp_path / "lamp.plux")
    height, size, side = CENTRE[2] - 4 * RADIUS, 1.0, 4
    camera = np.eye(4)
    camera[:3, 3] = *CENTRE[:2], height + 0.01
    blender.run(
        ("empty", {}), ("plux", {"path": str(path)}),
        ("floor", {"z": height, "size": 6}),
        ("picture", {"path": str(tmp_path / "floor.exr"), "camera": camera.tolist(),
                     "size": size, "pixels": side, "samples": 1024}),
    )  # fmt: skip
    found = pixels(tmp_path / "floor.exr")
    opened, fine = Luminaire.open(path), 3 * side
    along = ((np.arange(fine) + 0.5) / fine - 0.5) * size
    x, y = np.meshgrid(CENTRE[0] + along, CENTRE[1] - along)
    point = np.stack([x, y, np.full_like(x, height)], -1).reshape(-1, 3)
    light = by_surface(opened, point)
    expected = light.reshape(side, 3, side, 3, 3).mean((1, 3)) * 0.5 / np.pi
    assert np.allclose(found, expected, rtol=0.05), found / expected
    assert found.mean() == pytest.approx(expected.mean(), rel=0.015)


def by_surface(lamp: Luminaire, point: np.ndarray) -> np.ndarray:
    """Irradiance of upward floors from rays toward the middles of a fine grid over the cap."""
    total = np.zeros_like(point)
    side, sphere = 160, lamp.manifest.bounding_sphere
    u = (np.stack(np.meshgrid(*[np.arange(side)] * 2), -1).reshape(-1, 2) + 0.5) / side
    for k, here in enumerate(point):
        seen = cap(here[None], sphere)
        toward = np.asarray(cap_to_direction(u, cap(np.tile(here, (len(u), 1)), sphere)))
        hits = lamp.exit_surface.intersect(np.tile(here, (len(u), 1)), toward)
        radiance = lamp.radiance(hits.position, hits.normal, -toward[hits.ray])
        cosine = toward[hits.ray][:, 2:]
        total[k] = (radiance * cosine).sum(0) / len(u) * float(np.ravel(seen.solid_angle)[0])
    return total
