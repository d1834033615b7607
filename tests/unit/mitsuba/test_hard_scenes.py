"""Scenes that few make: weights that change, cameras that clip, limits, films of other colours."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba.output.passes import render_passes
from tests.support import analytic_lamps as lamps

T = mi.ScalarTransform4f


@pytest.fixture(scope="module")
def lamp(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = lamps.ball().write(tmp_path_factory.mktemp("lamps") / "ball.plux")
    return {"type": "purelight", "filename": str(path), "to_world": T().translate([0, 0.3, 0.3])}


def panel(weight: float) -> dict[str, Any]:
    light = {"type": "area", "radiance": 3.0, "sampling_weight": weight}
    place = lamps.look_at((0.5, -1.2, 1.2), (0, 0, -0.5)) @ T().scale(0.3)
    return {"type": "rectangle", "to_world": place, "emitter": light}


def integrator(**values: Any) -> mi.Integrator:
    return mi.load_dict({"type": "purelight", "max_depth": 3} | values)


def mean(scene: mi.Scene, by: mi.Integrator) -> float:
    return float(np.array(mi.render(scene, integrator=by, spp=256, seed=1))[..., :3].mean())


def test_weights_change_the_noise_alone(lamp: dict[str, Any]) -> None:
    """None aims at what has a weight of zero; what meets it sees it nevertheless."""
    spot = {"type": "point", "position": [0, 0, 1], "intensity": 0.01}
    scene = mi.load_dict(lamps.room() | {"panel": panel(1.0), "spot": spot, "lamp": lamp})
    ours = integrator()
    before = mean(scene, ours)
    parameters = mi.traverse(scene)
    parameters["panel.emitter.sampling_weight"] = 0.0
    parameters.update()
    assert mean(scene, ours) == pytest.approx(before, rel=0.05)
    alone = mi.load_dict(lamps.room() | {"panel": panel(0.0), "lamp": lamp | {"dimmer": 0.0}})
    path = mi.load_dict({"type": "path", "max_depth": 3})
    assert mean(alone, ours) == pytest.approx(mean(alone, path), rel=0.05)


def test_a_refused_dimmer_changes_nothing(lamp: dict[str, Any]) -> None:
    scene = mi.load_dict(lamps.room() | {"lamp": lamp})
    ours = integrator()
    before = mean(scene, ours)
    parameters = mi.traverse(scene)
    for level in (-1.0, float("nan")):
        parameters["lamp.dimmer"] = level
        with pytest.raises(PureLightError, match="dimmer must be"):
            parameters.update()
        assert mean(scene, ours) == before


def test_a_camera_clips_lamps_too(lamp: dict[str, Any]) -> None:
    """As it does everything else; what it does not see lights the room all the same."""
    view = {"type": "perspective", "to_world": lamps.look_at((3, 0.3, 0.3), (0, 0.3, 0.3)),
            "fov": 3, "film": {"type": "hdrfilm", "width": 8, "height": 8}}  # fmt: skip
    whole = mi.load_dict({"type": "scene", "camera": view, "lamp": lamp})
    clipped = mi.load_dict({"type": "scene", "camera": view | {"far_clip": 1.0}, "lamp": lamp})
    assert mean(whole, integrator()) > 0
    for engine in ("fused", "queued"):
        assert mean(clipped, integrator(engine=engine)) == 0


def test_limits_are_those_of_the_stock_integrators(lamp: dict[str, Any]) -> None:
    scene = mi.load_dict(lamps.room() | {"lamp": lamp})
    assert mean(scene, integrator(max_depth=0)) == 0
    for wrong in ({"max_depth": -2}, {"rr_depth": 0}):
        with pytest.raises((PureLightError, RuntimeError), match="max_depth must be -1 or more"):
            integrator(**wrong)


def test_films_of_other_colours_are_refused(lamp: dict[str, Any]) -> None:
    room = lamps.room()
    film = {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "xyz"}
    room["camera"] = {"type": "perspective", "film": film}
    scene = mi.load_dict({k: v for k, v in room.items() if k != "sensor"} | {"lamp": lamp})
    with pytest.raises(PureLightError, match="pixel_format is xyz; give it rgb or rgba"):
        render_passes(scene, integrator(), 1)
