"""The example lamps: they load, their meshes are closed, and most of their light gets out."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from purelight_examples.luminaires import crystal, filament_bulb, frosted_globe
from purelight_examples.luminaires.lamp_scene import emitted_flux
from purelight_mitsuba import platform

LAMPS = {"crystal": crystal, "filament_bulb": filament_bulb, "frosted_globe": frosted_globe}


@pytest.fixture(params=LAMPS.values(), ids=LAMPS.keys())
def lamp(request: pytest.FixtureRequest) -> ModuleType:
    return request.param


def test_every_mesh_is_closed(lamp: ModuleType) -> None:
    for part in lamp.parts():
        assert part.mesh.is_watertight, part.name
        assert part.mesh.is_winding_consistent, part.name


def test_glass_never_touches_coincidentally(lamp: ModuleType) -> None:
    vertices = np.concatenate([part.mesh.vertices for part in lamp.parts()])
    assert len(np.unique(vertices.round(9), axis=0)) == len(vertices)


def test_writes_the_same_files_twice(lamp: ModuleType, tmp_path: Path) -> None:
    first, second = lamp.write(tmp_path / "a"), lamp.write(tmp_path / "b")
    files = sorted(p.relative_to(tmp_path / "a") for p in first.parent.rglob("*") if p.is_file())
    assert len(files) == len(lamp.parts()) + 1
    for file in files:
        assert (first.parent / file).read_bytes() == (second.parent / file).read_bytes()


def test_loads_with_flat_emitters_of_a_household_size(lamp: ModuleType, tmp_path: Path) -> None:
    mi = platform.use()
    scene = mi.load_file(str(lamp.write(tmp_path)))
    shining = [shape for shape in scene.shapes() if shape.is_emitter()]
    assert len(shining) == 1
    assert not shining[0].has_vertex_normals()
    size = np.array(scene.bbox().max) - np.array(scene.bbox().min)
    assert (size > 0.09).all()
    assert (size < 0.15).all()


def test_most_light_escapes(lamp: ModuleType, tmp_path: Path) -> None:
    mi = platform.use()
    light_tracing = pytest.importorskip("purelight_train.light.light_tracing")
    scene = mi.load_file(str(lamp.write(tmp_path)))
    records = light_tracing.trace_records(scene, 1 << 16, seed=0)
    emitted = np.array(emitted_flux(lamp.parts()))
    assert 1 < emitted.max() < 20
    assert (records.flux < emitted).all()
    assert records.flux[0] > 0.55 * emitted[0]  # amber glass takes green and blue
