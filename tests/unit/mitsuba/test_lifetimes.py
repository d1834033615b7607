"""What outlives a scene: nothing that Mitsuba would still ask for its shape."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support import analytic_lamps as lamps

T = mi.ScalarTransform4f
AREA = {
    "type": "rectangle",
    "to_world": T().translate([0, 0, 2]).rotate([1, 0, 0], 180).scale(0.2),
    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 3.0}},
}


@pytest.fixture
def _no_collection() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def room(bundle: Path | None) -> mi.Scene:
    lamp = {} if bundle is None else {"lamp": {"type": "purelight", "filename": str(bundle)}}
    return mi.load_dict(lamps.room() | {"light": AREA} | lamp)


def shapes_of_emitters(scene: mi.Scene) -> np.ndarray:
    """A call that Dr.Jit makes of every emitter that is alive."""
    return np.array(dr.reinterpret_array(mi.UInt32, scene.emitters_dr().get_shape()))


@pytest.mark.usefixtures("_no_collection")
@pytest.mark.parametrize("lamp", [False, True])
def test_an_integrator_that_outlives_its_scene(tmp_path: Path, lamp: bool) -> None:
    bundle = lamps.ball().write(tmp_path / "ball.plux") if lamp else None
    integrator = mi.load_dict({"type": "purelight", "max_depth": 2})
    pictures = []
    for _ in range(3):
        pictures.append(np.array(mi.render(room(bundle), integrator=integrator, spp=2, seed=0)))
        assert (shapes_of_emitters(mi.load_dict({"type": "scene", "light": AREA})) > 0).all()
    assert pictures[0].mean() > 0
    assert all((picture == pictures[0]).all() for picture in pictures)
