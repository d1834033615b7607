"""The emitter plugin: files, sharing, parameters and refusals."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.lamps.emitter import BundleEmitter
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.lamps.table import Lamps
from tests.support import analytic_lamps as lamps
from tests.support.agreement import passes

T = mi.ScalarTransform4f


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    return lamps.ball().write(tmp_path / "ball.plux")


def lamp(path: Path, **settings: Any) -> dict[str, Any]:
    return {"type": "purelight", "filename": str(path), **settings}


def test_a_file_is_found_beside_the_scene(bundle: Path) -> None:
    scene = bundle.with_name("scene.xml")
    scene.write_text(
        '<scene version="3.0.0"><emitter type="purelight"><string name="filename" '
        'value="ball.plux"/><transform name="to_world"><translate x="3"/></transform>'
        '<float name="dimmer" value="0.5"/></emitter><integrator type="purelight"/></scene>'
    )
    loaded = mi.load_file(str(scene))
    (emitter,) = loaded.emitters()
    assert emitter.luminaire is load(bundle)
    assert emitter.level == 0.5
    np.testing.assert_allclose(emitter.placement.translation, [3, 0, 0])
    box = emitter.bbox()
    np.testing.assert_allclose(
        np.array(box.center()).ravel(), np.add(lamps.CENTRE, [3, 0, 0]), atol=1e-6
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"filename": "nowhere.plux"}, "no such file"),
        ({"dimmer": -1.0}, "dimmer"),
        ({"dimmer": float("nan")}, "dimmer"),
        ({"to_world": T().scale([1, 2, 1])}, "shears or scales"),
    ],
)
def test_refusals_name_the_fault(bundle: Path, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(RuntimeError, match=rf"PureLightError: .*{message}"):
        mi.load_dict(lamp(bundle) | settings)


def test_a_file_that_is_no_bundle(tmp_path: Path) -> None:
    path = tmp_path / "lamp.plux"
    path.write_bytes(b"nothing")
    with pytest.raises(RuntimeError, match=r"PureLightError: .*not a valid bundle"):
        mi.load_dict(lamp(path))


def test_equal_bundles_share_their_networks(bundle: Path) -> None:
    copy = bundle.with_name("copy.plux")
    copy.write_bytes(bundle.read_bytes())
    assert load(bundle) is load(bundle)
    assert load(copy) is load(bundle)
    lamps.ball(0.5).write(copy)
    assert load(copy) is not load(bundle)


def test_parameters_move_and_dim_a_lamp(bundle: Path) -> None:
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(bundle)})
    integrator = mi.load_dict({"type": "purelight", "max_depth": 2})
    before = passes(scene, integrator, spp=16, count=1)
    params = mi.traverse(scene)
    params["lamp.dimmer"] = 0.5
    params.update()
    dimmed = passes(scene, integrator, spp=16, count=1)
    np.testing.assert_allclose(dimmed, 0.5 * before, rtol=1e-4)
    params["lamp.to_world"] = mi.Transform4f().translate([0, 0, 1])
    params.update()
    moved = passes(scene, integrator, spp=16, count=1)
    there = lamp(bundle, dimmer=0.5, to_world=T().translate([0, 0, 1]))
    fresh = passes(mi.load_dict(lamps.room() | {"lamp": there}), integrator, 16, 1)
    np.testing.assert_allclose(moved, fresh, rtol=1e-4)
    assert np.abs(moved - dimmed).max() > 0.1


def test_a_bundle_written_anew_is_read_before_the_next_rendering(bundle: Path) -> None:
    scene = mi.load_dict(lamps.room() | {"a": lamp(bundle), "b": lamp(bundle)})
    integrator = mi.load_dict({"type": "purelight", "max_depth": 2})
    before = passes(scene, integrator, spp=16, count=1)
    lamps.ball(0.5).write(bundle)
    after = passes(scene, integrator, spp=16, count=1)
    assert np.abs(after - before).max() > 0.1
    first, second = scene.emitters()
    assert first.luminaire is second.luminaire is load(bundle)
    bundle.unlink()
    kept = passes(scene, integrator, spp=16, count=1)
    np.testing.assert_allclose(kept, after, rtol=1e-4)
    bundle.write_bytes(b"nothing")
    with pytest.raises(Exception, match="not a valid bundle"):
        integrator.prepare(scene)


def test_instances_share_networks_and_their_surface(bundle: Path) -> None:
    places = {f"l{k}": lamp(bundle, to_world=T().translate([k, 0, 0])) for k in range(20)}
    scene = mi.load_dict(lamps.room() | places)
    table = Lamps(scene.emitters(), scene)
    assert len({id(emitter.luminaire) for emitter in scene.emitters()}) == 1
    assert table.luminaires == [load(bundle)]


def test_many_lamps_are_not_loaded_one_within_another(
    bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thread that waits for Dr.Jit takes up the next lamp, up to Python's limit of recursion."""
    begin, depth = BundleEmitter.__init__, []

    def noted(self: BundleEmitter, props: mi.Properties) -> None:
        begin(self, props)
        depth.append(sum(frame.function == "noted" for frame in inspect.stack(0)))

    monkeypatch.setattr(BundleEmitter, "__init__", noted)
    many = {f"l{k}": lamp(bundle, to_world=T().translate([k, 0, 0])) for k in range(300)}
    busy = dr.arange(mi.Float, 1 << 24) ** dr.opaque(mi.Float, 0.7)
    dr.eval(busy)  # To be waited for
    mi.load_dict({"type": "scene"} | many)
    assert len(depth) >= 300
    assert max(depth) == 1


def test_a_missing_map_is_named_in_fast_mode(tmp_path: Path) -> None:
    path = lamps.glass_sheet([0.5] * 3).write(tmp_path / "sheet.plux")
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(path)})
    with pytest.raises(Exception, match="no fast_map network"):
        mi.load_dict({"type": "purelight", "mode": "fast"}).prepare(scene)


def test_too_many_overlapping_lamps_are_refused(bundle: Path) -> None:
    copies = {f"l{k}": lamp(bundle, to_world=T().translate([k * 0.1, 0, 0])) for k in range(65)}
    scene = mi.load_dict(lamps.room() | copies)
    with pytest.raises(Exception, match="65 lamps have overlapping"):
        Lamps(scene.emitters(), scene)


def test_stock_integrators_get_no_light_from_it(bundle: Path) -> None:
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(bundle)})
    image = passes(scene, {"type": "path"}, spp=4, count=1)
    assert (image == 0).all()


def test_a_scene_without_lamps_renders_as_path_tracing_does() -> None:
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": [1.0, 2.0, 3.0]}}
    scene = mi.load_dict(lamps.room() | {"sky": sky})
    ours = passes(scene, {"type": "purelight", "max_depth": 4})
    path = passes(scene, {"type": "path", "max_depth": 4})
    np.testing.assert_allclose(ours.mean((0, 1, 2)), path.mean((0, 1, 2)), rtol=5e-3)


def test_a_room_without_any_light_is_black() -> None:
    scene = mi.load_dict(lamps.room())
    assert (passes(scene, {"type": "purelight"}, spp=1, count=1) == 0).all()
