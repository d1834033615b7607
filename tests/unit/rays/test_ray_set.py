"""Rays of a file on the device: shared by all emitters of it, drawn by their power."""

from __future__ import annotations

import gc
import os
import weakref
from pathlib import Path

import drjit as dr
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

from purelight_train.light.plugins import ray_file_plugin  # noqa: E402
from purelight_train.light.ray_set import RaySet, load  # noqa: E402

LED = disc()
PLACES = [
    '<rotate y="1" angle="90"/><translate x="0.1"/>',
    '<scale value="2"/><translate z="-3"/>',
    '<rotate x="1" angle="180"/>',
]


def written(folder: Path, rays: Rays = LED) -> Path:
    path = folder / "led.tm25ray"
    write_ray_file(path, file_of(rays, "LED"))
    return path


def test_a_file_is_in_memory_once_and_no_longer_than_it_is_used(tmp_path: Path) -> None:
    path = written(tmp_path)
    (tmp_path / "below").mkdir()
    first, second = load(path), load(tmp_path / "below" / ".." / path.name)
    assert second is first
    gone = weakref.ref(first)
    del first, second
    gc.collect()
    assert gone() is None


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path)
    before = load(path)
    written(tmp_path, LED.take(slice(100)))
    os.utime(path, ns=(1, 1))
    assert len(load(path).rays) == 100
    assert len(before.rays) == len(LED)


def test_a_missing_file_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match=r"nowhere.tm25ray: cannot read: [^\n]+$"):
        load(tmp_path / "nowhere.tm25ray")


def test_rays_are_drawn_by_their_power() -> None:
    """Each sample carries its rays' power over their probability, whose mean is the flux."""
    power = LED.power * np.random.default_rng(0).lognormal(sigma=2, size=(len(LED), 1))
    rays = Rays(LED.position, LED.direction, power.astype(np.float32))
    u = np.random.default_rng(1).random((2, 1 << 16)).astype(np.float32)
    start, direction, weight = RaySet(rays).sample(mi.Float(u[0]), mi.Float(u[1]), mi.Mask(True))
    found = np.array(weight)
    error = found.std(1) / np.sqrt(found.shape[1])
    assert (np.abs(found.mean(1) - rays.flux) <= 4 * error + 1e-6 * rays.flux).all()
    assert found[0].max() < 1.3 * found[0].mean()
    np.testing.assert_allclose(np.linalg.norm(np.array(direction), axis=0), 1, rtol=1e-5)
    assert np.linalg.norm(np.array(start), axis=0).max() < 0.01


def test_emitters_of_one_file_stand_where_each_is_put(tmp_path: Path) -> None:
    """With its own flux; all of them draw from the same rays."""
    ray_file_plugin()
    path = written(tmp_path)
    lamps = "".join(
        f'<emitter type="ray_file"><string name="filename" value="{path}"/>'
        f'<float name="flux" value="{10 * (k + 1)}"/><transform name="to_world">{place}'
        "</transform></emitter>"
        for k, place in enumerate(PLACES)
    )
    emitters = mi.load_string(f'<scene version="3.0.0">{lamps}</scene>').emitters()
    u = np.random.default_rng(2).random((3, 1 << 14)).astype(np.float32)
    for k, emitter in enumerate(emitters):
        point = mi.Point2f(u[1], u[2])
        ray, weight = emitter.sample_ray(0.0, mi.Float(u[0]), point, point, True)
        low, high = (np.array(c) for c in (emitter.bbox().min, emitter.bbox().max))
        at = np.array(ray.o).T
        assert (at >= low - 1e-6).all()
        assert (at <= high + 1e-6).all()
        expected = emitter.rays.position
        np.testing.assert_allclose(low, expected.min(0), atol=1e-6)
        np.testing.assert_allclose(high, expected.max(0), atol=1e-6)
        lumens = 683 * np.array(weight).mean(1) @ [0.2126, 0.7152, 0.0722]
        assert lumens == pytest.approx(10 * (k + 1), rel=0.01)
        mean = emitter.rays.direction.mean(0)
        np.testing.assert_allclose(np.array(ray.d).mean(1), mean, atol=0.03)
        np.testing.assert_allclose(np.array(dr.norm(ray.d)), 1, rtol=1e-5)
