"""Albedo, normal and depth of what a picture shows first, the lamps as well as the room."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.output.first_hit import layers
from tests.support import analytic_lamps as lamps


@pytest.fixture
def scene(tmp_path: Path) -> mi.Scene:
    """A ball of radius 1 before a wall at x = -3, seen from x = 4."""
    lamps.ball().write(tmp_path / "ball.plux")
    at = mi.ScalarTransform4f()
    return mi.load_dict({
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 60,
            "to_world": at.look_at([4, 0, 0], [0, 0, 0], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 33, "height": 33, "rfilter": {"type": "box"}},
        },
        "wall": {
            "type": "rectangle",
            "to_world": at.look_at([-3, 0, 0], [4, 0, 0], [0, 0, 1]) @ at.scale([2, 9, 1]),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.4, 0.6]}},
        },
        "lamp": {
            "type": "purelight",
            "filename": str(tmp_path / "ball.plux"),
            "to_world": at.scale(1 / lamps.RADIUS)
            @ at.translate([-c for c in lamps.CENTRE]),
        },
    })  # fmt: skip


def test_layers_show_lamp_wall_and_nothing(scene: mi.Scene) -> None:
    found = layers(scene)
    middle, wall, nothing = (16, 16), (2, 16), (16, 0)
    np.testing.assert_allclose(found["albedo"][middle], 1)
    np.testing.assert_allclose(found["albedo"][wall], [0.2, 0.4, 0.6], atol=1e-6)
    np.testing.assert_allclose(found["albedo"][nothing], 0)
    np.testing.assert_allclose(found["normal"][middle], [1, 0, 0], atol=0.02)
    np.testing.assert_allclose(found["normal"][wall], [1, 0, 0], atol=1e-6)
    assert found["depth"][middle] == pytest.approx(3, abs=0.02)
    assert 7 < found["depth"][wall] < 7 / np.cos(np.radians(30))
    assert found["depth"][nothing] == np.inf


def test_layers_hide_what_the_picture_hides(scene: mi.Scene) -> None:
    found = layers(scene, hide_emitters=True)
    middle = (16, 16)
    np.testing.assert_allclose(found["albedo"][middle], [0.2, 0.4, 0.6], atol=1e-6)
    assert found["depth"][middle] == pytest.approx(7, abs=0.02)
