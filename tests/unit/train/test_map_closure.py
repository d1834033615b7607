"""The light that a fast map sends to all sides is made the traced light, near and far."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from purelight_format.measures import BoundingSphere
from purelight_train.learning.cap_samples import lit_points
from purelight_train.learning.map_closure import close_light, told_light
from purelight_train.light.description import Description
from purelight_train.light.direction_zones import fibonacci_lattice
from purelight_train.light.exit_records import ExitRecords
from purelight_train.networks.fast_map import KNOTS, NEAREST, FastMap, hats
from purelight_train.presets import DRAFT

CENTRE, RADIUS = (0.3, -0.2, 0.1), 0.5
SPHERE = BoundingSphere(CENTRE, RADIUS)
LAMP = Description(
    SPHERE, (3.0, 1.0, 0.0), (0.0, 0.0, 0.0), 1.0, (True, True, False), 1.0, 1
)  # fmt: skip
COUNT = 200_000


def unit(count: int, seed: int) -> np.ndarray:
    value = np.random.default_rng(seed).normal(size=(count, 3))
    return value / np.linalg.norm(value, axis=1, keepdims=True)


def light(weight: np.ndarray, start: np.ndarray, direction: np.ndarray) -> ExitRecords:
    """Light that all escapes; starts are in radii from the centre."""
    count = len(weight)
    at = (np.array(CENTRE) + RADIUS * start).astype(np.float32)
    d, bare = direction.astype(np.float32), np.zeros(count, bool)
    free = np.full(count, np.inf, np.float32)
    return ExitRecords(at, d, d, d, weight.astype(np.float32), free, bare, count)


def lopsided() -> ExitRecords:
    """Red light mostly downwards, green mostly sideways, from all over a ball of half the size."""
    direction = unit(COUNT, 1)
    weight = np.zeros((COUNT, 3))
    weight[:, 0] = 3 * np.exp(-0.6 * direction[:, 2]) / (np.sinh(0.6) / 0.6)
    weight[:, 1] = 1 + 0.5 * direction[:, 0]
    return light(weight, 0.5 * unit(COUNT, 2), direction)


def shares(toward: np.ndarray, power: np.ndarray) -> np.ndarray:
    """Red and green light by eighths of all sides: [8, 2]."""
    octant = (toward > 0) @ np.array([1, 2, 4])
    return np.stack([power[octant == k].sum(0) for k in range(8)])[:, :2]


@pytest.mark.parametrize("distance", [1.0, 2.0, 15.0])
def test_light_crosses_spheres_where_its_line_does(distance: float) -> None:
    records = lopsided()
    place = np.array(CENTRE) + distance * RADIUS * records.crossings(SPHERE, distance)
    way = place - records.position
    along = (way * records.direction).sum(1)
    assert (along > 0).all()
    np.testing.assert_allclose(way, along[:, None] * records.direction, atol=3e-6 * distance)


def test_hats_are_linear_between_knots_and_add_up() -> None:
    first = math.log(NEAREST) / math.log(LAMP.r_max)
    share = torch.linspace(first, 1, 4 * (KNOTS - 1) + 1)
    hat = torch.stack(hats(share, LAMP.r_max))
    torch.testing.assert_close(hat.sum(0), torch.ones(len(share)))
    torch.testing.assert_close(hat[:, ::4], torch.eye(KNOTS))
    torch.testing.assert_close(hat[:2, 1], torch.tensor([0.75, 0.25]))
    nearer = torch.stack(hats(torch.tensor([0.0]), LAMP.r_max))
    torch.testing.assert_close(nearer[:, 0], torch.eye(KNOTS)[0])


def fast_map(*, even: bool) -> FastMap:
    """An untrained map of about the right light, alike from everywhere or not."""
    torch.manual_seed(0)
    network = FastMap(LAMP, DRAFT)
    last = network.network[-1]
    assert isinstance(last, torch.nn.Linear)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(0.0 if even else 0.5)
        last.bias[-1] = np.log(LAMP.even_map[0] / LAMP.channel_scale[0])
    return network


@pytest.mark.parametrize("width", [0.03, 0.3])
def test_a_beam_keeps_its_light(width: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """However narrow, and along an axis too, where zones of directions are wide."""
    beam = unit(COUNT, 1) * width + [0, 0, -1]
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    weight = np.array([3.0, 1.0, 0.0]) * np.ones((COUNT, 1))
    network = fast_map(even=True)

    def too_bright(point: torch.Tensor, most: object) -> torch.Tensor:
        """A softer beam of half as much light again, which leaves some degrees beside the axis."""
        away = torch.nn.functional.normalize(point - torch.tensor(CENTRE), dim=-1)
        off = (away - torch.tensor([0.2 * width, 0.0, -1.0])).square().sum(-1)
        level = 1.5 * 4 / width**2 * np.array(LAMP.even_map) / np.array(LAMP.channel_scale)
        shape = torch.exp(-off / width**2)[:, None, None]
        return shape * torch.tensor(level, dtype=torch.float32).expand(len(point), 256, 3)

    monkeypatch.setattr(network, "value", too_bright)
    before = told_light(network, LAMP.r_max, fibonacci_lattice(1 << 14)).sum(0)
    np.testing.assert_allclose(before, [4.5, 1.5, 0], rtol=0.1)
    close_light(network, light(weight, 0.1 * width * unit(COUNT, 2), beam))
    told = told_light(network, LAMP.r_max, fibonacci_lattice(1 << 14))
    np.testing.assert_allclose(told.sum(0), [3, 1, 0], rtol=0.02)


@pytest.mark.parametrize("between", [0.0, 0.5])
def test_a_map_shines_as_traced_light_does(between: float) -> None:
    """At the knots whatever it was; between them if it has learned what distance does."""
    network, records = fast_map(even=between > 0), lopsided()
    close_light(network, records)
    weight, toward = records.weight / records.paths, fibonacci_lattice(1 << 13)
    knots = np.array(network.knot_distances())
    for distance in knots[:-1] ** (1 - between) * knots[1:] ** between:
        told = told_light(network, distance, toward)
        traced = shares(records.crossings(SPHERE, distance), weight)
        np.testing.assert_allclose(told.sum(0)[:2], [3, 1], rtol=0.03 if between else 0.005)
        np.testing.assert_allclose(shares(toward, told), traced, rtol=0.06 if between else 0.03)
        assert told[:, 2].max() == 0


def test_lit_points_are_where_light_goes() -> None:
    """A beam has nearly all of them; its other side none."""
    direction = unit(COUNT, 1)
    weight = np.where(direction[:, 2:] < -0.99, 1.0, 1e-9) * np.ones(3)
    rng = np.random.default_rng(0)
    point = lit_points(LAMP, light(weight, np.zeros((COUNT, 3)), direction), 4000, rng)
    away = (point - np.array(CENTRE)) / RADIUS
    distance = np.linalg.norm(away, axis=1)
    assert distance.min() > 1
    assert distance.max() <= LAMP.r_max * (1 + 1e-6)
    np.testing.assert_allclose(np.log(distance).mean(), np.log(LAMP.r_max) / 2, rtol=0.03)
    assert (away[:, 2] < -0.98 * distance).mean() > 0.99


def test_harmonics_are_those_of_few_records_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all records of a run together they would be gigabytes; the tilt is the same."""
    from purelight_train.learning import flux_closure

    def closed() -> tuple[torch.Tensor, int]:
        network, rows = fast_map(even=False), []
        harmonics = network.harmonics
        seen = harmonics.register_forward_hook(lambda _, given, __: rows.append(len(given[0])))
        close_light(network, lopsided())
        seen.remove()
        return network.tilt, max(rows)

    few = 1 << 15
    whole, most = closed()
    assert most > few
    monkeypatch.setattr(flux_closure, "PASS", few)
    parts, most = closed()
    assert most == few
    torch.testing.assert_close(parts, whole, rtol=1e-4, atol=1e-6)
