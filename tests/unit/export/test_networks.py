"""The five networks against the torch modules they were made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from purelight_export import networks
from purelight_format.measures import cap, cap_to_direction
from purelight_onnx.session import Session
from purelight_train.light.description import Description
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Preset

Wild = Callable[[type[nn.Module], Description, Preset], Any]
Unit = Callable[..., np.ndarray]
ROWS = 1025


def tensors(*arrays: np.ndarray) -> list[torch.Tensor]:
    return [torch.from_numpy(array) for array in arrays]


@pytest.fixture
def surface_inputs(description: Description, unit: Unit) -> dict[str, np.ndarray]:
    sphere, rng = description.sphere, np.random.default_rng(2)
    position = np.array(sphere.center) + sphere.radius * unit(ROWS) * rng.random((ROWS, 1))
    return {"position": position.astype("f4"), "normal": unit(ROWS, 1), "outgoing": unit(ROWS, 2)}


@pytest.fixture
def point(description: Description, unit: Unit) -> np.ndarray:
    """Points from just outside the sphere to ten times r_max."""
    sphere = description.sphere
    distance = sphere.radius * (1 + np.logspace(-2, np.log10(150), ROWS)[:, None])
    return (np.array(sphere.center) + distance * unit(ROWS)).astype(np.float32)


@pytest.mark.parametrize("compact", [False, True])
def test_appearance(
    description: Description,
    preset: Preset,
    wild: Wild,
    surface_inputs: dict[str, np.ndarray],
    compact: bool,
) -> None:
    student = wild(Student, description, preset)
    generator = torch.Generator().manual_seed(1)
    student.gain.copy_(torch.tensor([1.1, 0.9, 1.0]))
    student.tilt.copy_(0.2 * torch.randn(student.tilt.shape, generator=generator))
    with torch.no_grad():
        student.ceiling.copy_(student.raw(*tensors(*surface_inputs.values())).quantile(0.9, 0))
    result = Session(networks.appearance(student, compact=compact))(surface_inputs)["radiance"]
    with torch.no_grad():
        expected = student(*tensors(*surface_inputs.values())).numpy()
    assert expected.max() > description.radiance_scale / 10
    tolerance = (5e-4 if compact else 5e-6) * description.radiance_scale
    np.testing.assert_allclose(result, expected, rtol=1e-5, atol=tolerance)


@pytest.mark.parametrize("route", ["teacher", "photons"])
@pytest.mark.parametrize("anchor", ["none", "straight", "refracted", "both"])
@pytest.mark.parametrize("compact", [False, True])
def test_appearance_of_every_route(
    description: Description,
    preset: Preset,
    wild: Wild,
    surface_inputs: dict[str, np.ndarray],
    compact: bool,
    anchor: str,
    route: str,
) -> None:
    student = wild(Student, description, preset.for_route(route, anchor=anchor))
    result = Session(networks.appearance(student, compact=compact))(surface_inputs)["radiance"]
    with torch.no_grad():
        expected = student(*tensors(*surface_inputs.values())).numpy()
    np.testing.assert_allclose(
        result, expected, rtol=1e-3 if compact else 1e-5, atol=5e-4 * description.radiance_scale
    )


@pytest.mark.parametrize("power", [1e-6, 1e6])
def test_the_power_of_a_lamp_only_scales_its_radiance(
    description: Description,
    preset: Preset,
    wild: Wild,
    surface_inputs: dict[str, np.ndarray],
    power: float,
) -> None:
    results = []
    for factor in (1.0, power):
        changed = replace(description, radiance_scale=description.radiance_scale * factor)
        model = networks.appearance(wild(Student, changed, preset))
        results.append(Session(model)(surface_inputs)["radiance"] / factor)
    np.testing.assert_allclose(results[0], results[1], rtol=1e-5)


@pytest.mark.parametrize("one_hot", [False, True])
def test_absent_channels_are_exactly_zero(
    description: Description, preset: Preset, wild: Wild, surface_inputs: dict[str, np.ndarray],
    point: np.ndarray, one_hot: bool,
) -> None:  # fmt: skip
    preset = replace(preset, fast_map_one_hot=one_hot)
    red = replace(description, channels=(True, False, False))
    radiance = Session(networks.appearance(wild(Student, red, preset)))(surface_inputs)["radiance"]
    assert radiance[:, 0].any()
    assert not radiance[:, 1:].any()
    fast = Session(networks.fast_map(wild(FastMap, red, preset)))({"point": point})["radiance_map"]
    assert fast[..., 0].any()
    assert not fast[..., 1:].any()


def test_a_black_lamp_is_black(
    description: Description, preset: Preset, wild: Wild, surface_inputs: dict[str, np.ndarray],
    point: np.ndarray,
) -> None:  # fmt: skip
    black = replace(description, channels=(False, False, False))
    model = networks.appearance(wild(Student, black, preset))
    assert not Session(model)(surface_inputs)["radiance"].any()
    model = networks.fast_map(wild(FastMap, black, preset))
    assert not Session(model)({"point": point})["radiance_map"].any()


@pytest.mark.parametrize("compact", [False, True])
def test_transparency(
    description: Description,
    preset: Preset,
    wild: Wild,
    surface_inputs: dict[str, np.ndarray],
    compact: bool,
) -> None:
    network = wild(Transparency, description, preset)
    model = networks.transparency(network, compact=compact)
    result = Session(model)(surface_inputs)["transmittance"]
    with torch.no_grad():
        expected = network(*tensors(*surface_inputs.values())).numpy()
    np.testing.assert_allclose(result, expected, atol=1e-4 if compact else 1e-6)


def test_sampler(description: Description, preset: Preset, wild: Wild, point: np.ndarray) -> None:
    network = wild(Sampler, description, preset)
    u = np.random.default_rng(3).random((ROWS, 2)).astype(np.float32)
    result = Session(networks.sampler(network))({"point": point, "u": u})
    with torch.no_grad():
        toward, pdf = network(*tensors(point, u))
    np.testing.assert_allclose(result["toward"], toward.numpy(), atol=2e-5)
    np.testing.assert_allclose(result["pdf_solid_angle"], pdf.numpy(), rtol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(result["toward"], axis=1), 1, atol=1e-6)


def test_the_pdf_network_agrees_with_the_sampler(
    description: Description, preset: Preset, wild: Wild, point: np.ndarray
) -> None:
    network = wild(Sampler, description, preset)
    u = np.random.default_rng(3).uniform(0.05, 0.95, (ROWS, 2)).astype(np.float32)
    sample = Session(networks.sampler(network))({"point": point, "u": u})
    feed = {"point": point, "toward": sample["toward"]}
    pdf = Session(networks.sampler_pdf(network))(feed)["pdf_solid_angle"]
    ratio = pdf / sample["pdf_solid_angle"]
    assert np.quantile(np.abs(ratio - 1), 0.99) < 1e-2
    with torch.no_grad():
        expected = network.pdf_solid_angle(*tensors(*feed.values())).numpy()
    assert np.quantile(np.abs(pdf / np.maximum(expected, 1e-30) - 1), 0.99) < 2e-3


def test_the_pdf_is_zero_beside_the_cap(
    description: Description, preset: Preset, wild: Wild, point: np.ndarray
) -> None:
    away = point - np.array(description.sphere.center, np.float32)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    model = networks.sampler_pdf(wild(Sampler, description, preset))
    assert not Session(model)({"point": point, "toward": away})["pdf_solid_angle"].any()


@pytest.mark.parametrize("distance", [0.0, 0.5, 1.0])
def test_points_inside_the_sphere_have_no_pdf(
    description: Description, preset: Preset, wild: Wild, unit: Unit, distance: float
) -> None:
    sphere = description.sphere
    offset = unit(100) * sphere.radius * distance * (1 - 1e-6)
    point = (np.array(sphere.center) + offset).astype(np.float32)
    u = np.random.default_rng(3).random((100, 2)).astype(np.float32)
    network = wild(Sampler, description, preset)
    result = Session(networks.sampler(network))({"point": point, "u": u})
    feed = {"point": point, "toward": result["toward"]}
    assert not result["pdf_solid_angle"].any()
    assert not Session(networks.sampler_pdf(network))(feed)["pdf_solid_angle"].any()
    expected = -unit(100) if distance else np.tile([0, 0, 1], (100, 1))
    np.testing.assert_allclose(result["toward"], expected, atol=1e-5 if distance else 0)


@pytest.mark.parametrize("distance", [1 + 2e-6, 1e6, 1e15, 1e30])
def test_hard_points_and_uniforms_stay_finite(
    description: Description, preset: Preset, wild: Wild, unit: Unit, distance: float
) -> None:
    sphere = description.sphere
    point = (np.array(sphere.center) + unit(64) * sphere.radius * distance).astype(np.float32)
    u = np.tile([[0, 0], [1 - 2**-24, 1 - 2**-24], [0, 1], [0.05, 0.5]], (16, 1)).astype("f4")
    network = wild(Sampler, description, preset)
    result = Session(networks.sampler(network))({"point": point, "u": u})
    assert all(np.isfinite(array).all() for array in result.values())
    np.testing.assert_allclose(np.linalg.norm(result["toward"], axis=1), 1, atol=1e-5)
    feed = {"point": point, "toward": result["toward"]}
    assert np.isfinite(Session(networks.sampler_pdf(network))(feed)["pdf_solid_angle"]).all()
    fast = Session(networks.fast_map(wild(FastMap, description, preset)))({"point": point})
    assert np.isfinite(fast["radiance_map"]).all()


@pytest.mark.parametrize("one_hot", [False, True])
@pytest.mark.parametrize("compact", [False, True])
def test_fast_map(
    description: Description, preset: Preset, wild: Wild, point: np.ndarray, compact: bool,
    one_hot: bool,
) -> None:  # fmt: skip
    preset = replace(preset, fast_map_one_hot=one_hot)
    network = wild(FastMap, description, preset)
    with torch.no_grad():
        value = network.value(torch.from_numpy(point), network.ceiling).flatten(0, 1)
        network.ceiling.copy_(torch.log(network.brightness(value))[::97].quantile(0.9, 0))
        network.tilt.copy_(0.5 * torch.randn(network.tilt.shape))
    model = networks.fast_map(network, compact=compact)
    result = Session(model)({"point": point})["radiance_map"]
    with torch.no_grad():
        expected = network(torch.from_numpy(point)).numpy()
    assert result.shape == (ROWS, 16, 16, 3)
    scale = max(description.channel_scale)
    np.testing.assert_allclose(
        result, expected, rtol=1e-5, atol=(3e-4 if compact else 1e-5) * scale
    )


@pytest.mark.parametrize("distance", [1.001, 1.5, 14.0, 100.0])
def test_the_pdf_integrates_to_one(
    description: Description, preset: Preset, wild: Wild, distance: float
) -> None:
    sphere, cells = description.sphere, 192
    offset = np.array([0.48, 0.6, -0.64]) * sphere.radius * distance
    point = np.tile(np.array(sphere.center) + offset, (cells**2, 1))
    middle = (np.arange(cells) + 0.5) / cells
    square = np.stack(np.meshgrid(middle, middle), -1).reshape(-1, 2)
    view = cap(point, sphere)
    toward = cap_to_direction(square, view)
    network = Session(networks.sampler_pdf(wild(Sampler, description, preset)))
    pdf = network({"point": point, "toward": toward})["pdf_solid_angle"]
    assert (pdf * view.solid_angle).mean() == pytest.approx(1, abs=3e-3)


@pytest.mark.parametrize("rows", [0, 1])
def test_any_number_of_rows(
    description: Description, preset: Preset, wild: Wild, rows: int
) -> None:
    model = networks.fast_map(wild(FastMap, description, preset))
    result = Session(model)({"point": np.zeros((rows, 3))})
    assert result["radiance_map"].shape == (rows, 16, 16, 3)
    model = networks.sampler(wild(Sampler, description, preset))
    result = Session(model)({"point": np.zeros((rows, 3)), "u": np.zeros((rows, 2))})
    assert result["toward"].shape == (rows, 3)
    assert result["pdf_solid_angle"].shape == (rows,)
