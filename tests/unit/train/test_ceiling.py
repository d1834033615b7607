"""No radiance beyond what light has shown: what a network makes of rays it never met is bounded."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import torch

from purelight_format.geometry import BoundingSphere
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


def light(count: int) -> ExitRecords:
    weight = np.tile(np.float32([1, 1, 0]), (count, 1))
    at = unit(count, 0)
    return ExitRecords(at, at, unit(count, 1), weight, np.zeros(count, bool), count)


@pytest.mark.parametrize("link", ["log", "log1p"])
@pytest.mark.parametrize("strays", [0, 3])
def test_ceiling_is_twice_the_radiance_of_light(link: str, strays: int) -> None:
    """A few rays of 1e8 times the mean, less than 1e-4 of the light, do not lift it."""
    from purelight_train.runs.evaluation import set_ceiling

    student = Student(LAMP, dataclasses.replace(DRAFT, student_link=link))
    student.gain.copy_(torch.tensor([0.9, 1.1, 1.0]))
    brightness = np.linspace(1, 100, 40_000)
    brightness[:strays] = 1e8
    factor = (student.scale * student.gain).numpy()

    def radiance(*_: np.ndarray) -> np.ndarray:
        return (brightness[:, None] * factor).astype(np.float32)

    set_ceiling(student, radiance, light(len(brightness)))
    bound = (math.exp if link == "log" else math.expm1)(float(student.ceiling))
    assert bound == pytest.approx(200, rel=1e-3)


@torch.no_grad()
@pytest.mark.parametrize("link", ["log", "log1p"])
def test_student_never_exceeds_its_ceiling(link: str) -> None:
    student = Student(LAMP, dataclasses.replace(DRAFT, student_link=link))
    student.network[-1].weight.mul_(1e4)
    rays = [torch.from_numpy(unit(4096, seed)) for seed in range(3)]
    assert float(student(*rays).max()) > 1e6
    student.ceiling.fill_(2.0)
    top = torch.exp(student.ceiling) if link == "log" else torch.expm1(student.ceiling)
    bound = top * student.scale * student.channels
    value = student(*rays)
    assert bool((value <= bound * (1 + 1e-6)).all())
    assert bool((value[:, :2] >= bound[:2] * (1 - 1e-6)).any())


@torch.no_grad()
def test_no_cell_of_the_map_is_brighter_than_what_it_learned() -> None:
    network = FastMap(LAMP, DRAFT)
    network.network[-1].weight.mul_(1e4)
    point, radiance = torch.from_numpy(3 * unit(64, 0)), torch.rand(64, 256, 3)
    network.close_power(point, radiance)
    bound = float((radiance[..., :2] / network.scale[:2]).max())
    far = network(torch.from_numpy(5 * unit(512, 1))) / (network.scale * network.gain)
    assert float(far[..., :2].max()) == pytest.approx(bound, rel=1e-4)
    total = network(point).sum((0, 1, 2))
    torch.testing.assert_close(total[:2], radiance.sum((0, 1))[:2], rtol=1e-4, atol=0)
