"""Emitters by power: the flux stays, the noise falls; emission from textures and points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

RADIANCES = (100.0, 1.0, 0.01)
RADIUS = 0.1


def spheres(mi: Any, radiances: tuple[float, ...]) -> Any:
    """A row of black glowing spheres."""
    return mi.load_dict(
        {
            "type": "scene",
            **{
                f"bulb{i}": {
                    "type": "sphere",
                    "center": [3 * RADIUS * i, 0, 0],
                    "radius": RADIUS,
                    "bsdf": {"type": "diffuse", "reflectance": 0.0},
                    "emitter": {"type": "area", "radiance": value},
                }
                for i, value in enumerate(radiances)
            },
        }
    )


def test_power_of_each_emitter(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import Lamp

    scene = spheres(mitsuba, RADIANCES)
    emission = Lamp(scene).emission
    power = 4 * math.pi**2 * RADIUS**2 * np.array(RADIANCES)
    np.testing.assert_allclose(emission.power(), np.tile(power[:, None], 3), rtol=1e-5)
    assert emission.probability.sum() == pytest.approx(1)
    assert emission.probability[2] > 0.003  # never left out


def test_flux_is_the_same_and_noise_falls(mitsuba: Any) -> None:
    """Against emitters chosen uniformly; the spheres shade each other, so it is no closed form."""
    from purelight_train.light.emission import Emission
    from purelight_train.light.light_tracing import Lamp, trace_records

    scene = spheres(mitsuba, RADIANCES)
    chosen = trace_records(scene, 1 << 20, 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "purelight_train.light.emission._probability", lambda power: np.full(len(power), 1 / 3)
        )
        uniform = trace_records(scene, 1 << 20, 1)
        assert Lamp(scene).emission.probability[0] == pytest.approx(1 / 3)
    error = np.hypot(chosen.flux_error, uniform.flux_error)
    assert (np.abs(chosen.flux - uniform.flux) < 4 * error).all()
    variance_ratio = (uniform.flux_error / chosen.flux_error) ** 2
    assert (variance_ratio > 10).all(), variance_ratio
    assert Emission.of(scene, 1.0).probability[0] > 0.9


def test_an_emitter_that_outlived_its_shape_disturbs_nobody(mitsuba: Any) -> None:
    from purelight_import.sanity.light import leaving
    from purelight_import.sanity.subject import Subject
    from purelight_train.light.light_tracing import trace_records

    kept = spheres(mitsuba, (1.0,)).emitters()  # of a scene that is gone
    scene, flux = spheres(mitsuba, (5.0,)), 4 * math.pi**2 * RADIUS**2 * 5
    np.testing.assert_allclose(trace_records(scene, 1 << 14, 0).flux, flux, rtol=1e-3)
    np.testing.assert_allclose(leaving(Subject(scene)).left.sum(0), flux, rtol=1e-3)
    assert len(kept) == 1


def test_a_faint_channel_gets_half_of_the_paths(mitsuba: Any) -> None:
    from purelight_train.light.emission import _probability

    power = np.array([[100.0, 0, 0], [0, 0, 0.1]])
    np.testing.assert_allclose(_probability(power), 0.5)
    assert (_probability(np.zeros((4, 3))) == 0.25).all()


def test_textured_emitter_keeps_its_picture(mitsuba: Any) -> None:
    """A square with a dark and a bright half: power, and where it comes from."""
    from purelight_train.light.light_tracing import trace_records

    picture = np.zeros((1, 2, 3), np.float32)
    picture[0, :] = [[1.0, 0.5, 0.0], [9.0, 4.5, 0.0]]
    bitmap = {
        "type": "bitmap",
        "bitmap": mitsuba.Bitmap(picture),
        "filter_type": "nearest",
        "raw": True,
    }
    square = {"type": "rectangle", "emitter": {"type": "area", "radiance": bitmap}}
    records = trace_records(mitsuba.load_dict({"type": "scene", "square": square}), 1, 0)
    expected = np.array([5.0, 2.5, 0.0]) * 4 * math.pi
    assert (np.abs(records.flux - expected) <= 4 * records.flux_error + 1e-6).all()
    bright = records.position[:, 0] > 0
    assert records.weight[bright, 0].sum() / records.weight[:, 0].sum() == pytest.approx(
        0.9, abs=2e-3
    )


def test_point_and_area_emitters_together(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "point": {"type": "point", "position": [0, 0, 3.0], "intensity": 2.0},
            "plate": {
                "type": "rectangle",
                "bsdf": {"type": "diffuse", "reflectance": 0.0},
                "emitter": {"type": "area", "radiance": 1.0},
            },
        }
    )
    records = trace_records(scene, 1, 0)
    # The black plate takes the part of the point's light within its solid angle
    solid_angle = 4 * math.asin(1 / 10)
    expected = 4 * math.pi + 2.0 * (4 * math.pi - solid_angle)
    assert (np.abs(records.flux - expected) < 4 * records.flux_error).all()
