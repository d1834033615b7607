"""No radiance beyond what light has shown: what a network makes of rays it never met is bounded."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.student import Student
from purelight_train.presets import DRAFT

LAMP = Description(
    BoundingSphere((0.0, 0.0, 0.0), 1.0), (3.0, 2.0, 0.0), (0.0, 0.0, 0.0), 1.0,
    (True, True, False), 1.0, 1,
)  # fmt: skip


@pytest.fixture(autouse=True)
def _seeded() -> None:
    torch.manual_seed(3)


def unit(count: int, seed: int) -> np.ndarray:
    value = np.random.default_rng(seed).normal(size=(count, 3))
    return (value / np.linalg.norm(value, axis=1, keepdims=True)).astype(np.float32)


def light(weight: np.ndarray) -> ExitRecords:
    """Light with weights [N, 3] that all escapes."""
    count = len(weight)
    at, free = unit(count, 0), np.full(count, np.inf, np.float32)
    bare = np.zeros(count, bool)
    return ExitRecords(at, at, at, unit(count, 1), weight.astype(np.float32), free, bare, count)


def ceilings(
    link: str, brightness: np.ndarray, weight: np.ndarray, brightest: np.ndarray
) -> np.ndarray:
    """Radiance that each channel is bounded by, where held-out light has `brightness` [N, 3]."""
    from purelight_train.runs.evaluation import set_ceiling

    student = Student(LAMP, dataclasses.replace(DRAFT, student_link=link))
    student.gain.copy_(torch.tensor([0.9, 1.1, 1.0]))
    set_ceiling(student, lambda *_: brightness.astype(np.float32), light(weight), brightest)
    unit = torch.exp(student.ceiling) if link == "log" else torch.expm1(student.ceiling)
    return (unit * student.scale * student.gain).detach().numpy()


@pytest.mark.parametrize("link", ["log", "log1p"])
@pytest.mark.parametrize("strays", [0, 3])
def test_ceiling_without_area_is_twice_the_radiance_of_light(link: str, strays: int) -> None:
    """A few rays of 1e8 times the mean, less than 1e-4 of the light, do not lift it."""
    brightness = np.repeat(np.linspace(1, 100, 40_000)[:, None], 3, 1)
    brightness[:strays] = 1e8
    weight = np.tile([1, 1, 0], (len(brightness), 1))
    bound = ceilings(link, brightness, weight, np.full(3, np.inf))
    np.testing.assert_allclose(bound[:2], 200, rtol=1e-3)


@pytest.mark.parametrize("link", ["log", "log1p"])
def test_no_emitter_is_dimmed(link: str) -> None:
    """A faint green light and one through a pinhole, each less than 1e-4 of all light, stay."""
    brightness = np.tile([10.0, 0.1, 0.0], (40_000, 1))
    weight = np.tile([1.0, 0.0, 0.0], (len(brightness), 1))
    brightness[:2, 0] = 5000  # the pinhole
    brightness[2:5, 1], weight[2:5] = 70, [0, 1e-3, 0]
    bound = ceilings(link, brightness, weight, np.array([6000.0, 80.0, 0.0]))
    np.testing.assert_allclose(bound[:2], [10_000, 140], rtol=1e-3)
    strays = brightness.copy()
    strays[9] = 1e8
    bound = ceilings(link, strays, weight, np.array([6000.0, 80.0, 0.0]))
    np.testing.assert_allclose(bound[0], 12_000, rtol=1e-3)


@torch.no_grad()
@pytest.mark.parametrize("link", ["log", "log1p"])
def test_student_never_exceeds_its_ceiling(link: str) -> None:
    student = Student(LAMP, dataclasses.replace(DRAFT, student_link=link))
    student.network[-1].weight.mul_(1e4)
    rays = [torch.from_numpy(unit(4096, seed)) for seed in range(3)]
    assert float(student(*rays).max()) > 1e6
    student.ceiling.copy_(torch.tensor([2.0, 3.0, 1.0]))
    top = torch.exp(student.ceiling) if link == "log" else torch.expm1(student.ceiling)
    bound = top * student.scale * student.channels
    value = student(*rays)
    assert bool((value <= bound * (1 + 1e-6)).all())
    assert bool((value[:, :2] >= bound[:2] * (1 - 1e-6)).any())


@torch.no_grad()
def test_no_cell_of_the_map_is_brighter_than_what_it_learned() -> None:
    network = FastMap(LAMP, DRAFT)
    network.network[-1].weight.mul_(1e4)
    radiance = torch.rand(64, 256, 3)
    network.set_ceiling(radiance)
    bound = network.brightness(radiance / network.scale).amax((0, 1))
    far = network(torch.from_numpy(5 * unit(512, 1))) / network.scale
    torch.testing.assert_close(network.brightness(far).amax((0, 1, 2)), bound, rtol=1e-4, atol=0)


@pytest.mark.parametrize("link", ["log", "log1p"])
def test_a_channel_of_which_no_light_was_held_out_has_a_ceiling(link: str) -> None:
    """As of few measured rays, where one in ten is held out and a hundredth is green."""
    brightness = np.repeat(np.linspace(1, 100, 40_000)[:, None], 3, 1)
    weight = np.tile([1, 0, 0], (len(brightness), 1))
    bound = ceilings(link, brightness, weight, np.full(3, np.inf))
    np.testing.assert_allclose(bound[:2], 200, rtol=1e-3)
