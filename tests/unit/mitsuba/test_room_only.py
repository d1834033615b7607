"""The far field of a lamp in Mitsuba's own integrators, and the IES text it is read from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.members import PHOTOMETRY
from purelight_format.photometry.table import node_solid_angle
from purelight_mitsuba.sampling.far_field import HORIZONTAL, VERTICAL, FarField
from tests.support import analytic_lamps as lamps
from tests.support.agreement import passes
from tests.support.twins import Ball, Hanging, Panel, T, twins

FACING = T().translate([0.2, 0.1, 1.6]).rotate([0.6, 0, 0.8], 25).scale(0.5)


def write(kind: Any, exponent: float, path: Path) -> Path:
    lamp = kind.lamp()
    return lamp.write(path, {PHOTOMETRY: lamps.photometry(lamp, exponent)})


@pytest.mark.parametrize(
    ("kind", "exponent"), [(Ball(), 0.0), (Panel(), 1.0), (Panel(exponent=4), 5.0)]
)
@pytest.mark.parametrize("integrator", ["path", "volpath"])
def test_a_far_lamp_lights_the_room_as_it_should(
    tmp_path: Path, kind: Any, exponent: float, integrator: str
) -> None:
    _, real = twins(tmp_path, lamps.room(size=8), [Hanging(kind, FACING, 2.0)])
    path = write(kind, exponent, tmp_path / "lamp.plux")
    emitter = {"type": "purelight_room_only", "filename": str(path), "to_world": FACING}
    scene = mi.load_dict(lamps.room(size=8) | {"lamp": emitter | {"dimmer": 2.0}})
    settings = {"type": integrator, "max_depth": 3, "hide_emitters": True}
    ours, expected = (passes(s, settings, spp=256, count=8) for s in (scene, real))
    assert np.isfinite(ours).all()
    np.testing.assert_allclose(ours.mean((0, 1, 2)), expected.mean((0, 1, 2)), rtol=0.03)
    np.testing.assert_allclose(ours.mean(0), expected.mean(0), rtol=0.12, atol=0.005)


def test_it_can_be_dimmed_and_moved_and_stands_beside_purelight(tmp_path: Path) -> None:
    path = write(Ball(), 0.0, tmp_path / "lamp.plux")
    emitter = {"type": "purelight_room_only", "filename": str(path), "to_world": FACING}
    scene = mi.load_dict(lamps.room(size=8) | {"lamp": emitter})
    settings = {"type": "path", "max_depth": 2}
    before = passes(scene, settings, spp=64, count=1)
    params = mi.traverse(scene)
    params["lamp.dimmer"] = 0.5
    params["lamp.to_world"] = mi.Transform4f(FACING.matrix) @ mi.Transform4f().translate([0, 0, 1])
    params.update()
    moved = passes(scene, settings, spp=64, count=1)
    there = emitter | {"to_world": FACING @ T().translate([0, 0, 1]), "dimmer": 0.5}
    fresh = mi.load_dict(lamps.room(size=8) | {"lamp": there})
    again = passes(fresh, settings, spp=64, count=1)
    np.testing.assert_allclose(moved, again, rtol=1e-4)
    assert np.abs(moved - before).max() > 0.001
    own = passes(fresh, {"type": "purelight", "max_depth": 2}, spp=64, count=1)
    np.testing.assert_allclose(own.mean(), again.mean(), rtol=0.02)


def test_a_bundle_without_photometry_is_refused(tmp_path: Path) -> None:
    path = lamps.ball().write(tmp_path / "lamp.plux")
    with pytest.raises(RuntimeError, match=r"PureLightError: .*no photometry\.ies"):
        mi.load_dict({"type": "purelight_room_only", "filename": str(path)})


def ies(horizontal: str, rows: list[str], *, tilt: str = "NONE", kind: int = 1) -> bytes:
    planes = len(horizontal.split())
    numbers = f"1 -1 1 3 {planes} {kind} 2 0 0 0\n1 1 5\n0 90 180\n{horizontal}\n"
    return (
        f"IES:LM-63-2019\n[TEST] 5 degrees\nTILT={tilt}\n{numbers}".encode()
        + "\n".join(rows).encode()
    )


@pytest.mark.parametrize(
    ("text", "symmetric"),
    [
        (ies("0", ["1 1 1"]), True),
        (ies("0 90", ["1 1 1", "1 1 1"]), True),
        (ies("0 180", ["1 1 1", "1 3 1"]), False),
        (ies("0 180 360", ["1 1 1", "1 3 1", "1 1 1"]), False),
    ],
)
def test_symmetric_tables_are_completed_and_integrate_to_one(text: bytes, symmetric: bool) -> None:
    values = FarField.of(text, "lamp").values
    assert values.shape == (HORIZONTAL, VERTICAL)
    total = values[:-1].mean(0) @ node_solid_angle(np.linspace(0, 180, VERTICAL))
    assert total == pytest.approx(1, rel=1e-4)
    np.testing.assert_allclose(values, values[::-1])
    ratio = values[HORIZONTAL // 2, 90] / values[0, 90]
    assert ratio == pytest.approx(1 if symmetric else 3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ies("0", ["1 1 1"], tilt="INCLUDE"), "TILT"),
        (ies("0", ["1 1 1"], kind=2), "type C"),
        (ies("0", ["1 1"]), "not IES"),
        (ies("0", ["1 x 1"]), "not IES"),
        (ies("90 0", ["1 1 1", "1 1 1"]), "not IES"),
        (b"TILT=NONE", "not IES"),
    ],
)
def test_other_photometry_is_refused(text: bytes, message: str) -> None:
    with pytest.raises(PureLightError, match=f"lamp.plux: .*{message}"):
        FarField.of(text, "lamp.plux")
