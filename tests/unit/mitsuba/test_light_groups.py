"""Light groups: layers that add up to the picture, each of them the light of its lamps alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from tests.support import analytic_lamps as lamps

ENGINES = ("fused", "queued")
MODES = ("accurate", "fast")
T = mi.ScalarTransform4f
PLACES = {
    "a": T().translate([0.1, 0.2, 0.3]),
    "b": T().translate([-0.6, 0.6, 0.3]).scale(0.5),
    "c": T().translate([-0.6, -0.6, 0.3]).scale(0.5),
}


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return lamps.ball().write(tmp_path_factory.mktemp("lamps") / "ball.plux")


def room(bundle: Path, dimmers: dict[str, float] | None = None, **more: Any) -> mi.Scene:
    """Three lamps, two of them of one group, and a light of Mitsuba's; some of them dimmed."""
    levels = {"a": 1.0, "b": 1.0, "c": 1.0, "light": 1.0} | (dimmers or {})
    light = {
        "type": "rectangle",
        "to_world": lamps.look_at((0.5, -1.2, 1.2), (0, 0, -0.5)) @ T().scale(0.2),
        "emitter": {
            "type": "area",
            "radiance": {"type": "rgb", "value": [levels["light"] * x for x in (1.0, 2.0, 4.0)]},
        },
    }
    hung = {
        name: {
            "type": "purelight", "filename": str(bundle), "to_world": place,
            "dimmer": levels[name], **({"light_group": "pair"} if name != "a" else {}) | more,
        }
        for name, place in PLACES.items()
    }  # fmt: skip
    return mi.load_dict(lamps.room() | {"light": light} | hung)


def layers(scene: mi.Scene, engine: str, mode: str, spp: int = 64) -> dict[str, np.ndarray]:
    """The picture, as `whole`, and its layers."""
    integrator = mi.load_dict({
        "type": "purelight", "engine": engine, "mode": mode, "max_depth": 4, "light_groups": True,
    })  # fmt: skip
    image = np.array(mi.render(scene, integrator=integrator, spp=spp, seed=1))
    names = [name.split(".")[1] for name in integrator.aov_names()[::3]]
    first = image.shape[-1] - 3 * len(names)
    parts = np.split(image[..., first:], len(names), axis=-1)
    return {"whole": image[..., :3]} | dict(zip(names, parts, strict=True))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("mode", MODES)
def test_layers_add_up_to_the_picture(bundle: Path, mode: str, engine: str) -> None:
    found = layers(room(bundle), engine, mode, 8)
    whole = found.pop("whole")
    assert list(found) == ["others", "a", "pair"]
    np.testing.assert_allclose(sum(found.values()), whole, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("group", ["others", "a", "pair"])
def test_a_layer_is_the_picture_with_all_other_light_off(
    bundle: Path, group: str, mode: str, engine: str
) -> None:
    members = {"others": ("light",), "a": ("a",), "pair": ("b", "c")}
    off = {name: 0.0 for key, names in members.items() if key != group for name in names}
    layer = layers(room(bundle), engine, mode)[group]
    alone = layers(room(bundle, off), engine, mode)["whole"]
    assert alone.mean() > 0.01
    assert layer.mean() == pytest.approx(alone.mean(), rel=0.04)
    blurred = [image.reshape(4, image.shape[0] // 4, 4, -1, 3).mean((1, 3))
               for image in (layer, alone)]  # fmt: skip
    np.testing.assert_allclose(*blurred, rtol=0.3, atol=0.1 * alone.mean())


def test_name_of_the_other_lights_is_taken(bundle: Path) -> None:
    integrator = mi.load_dict({"type": "purelight", "light_groups": True})
    with pytest.raises(PureLightError, match="choose another name"):
        integrator.prepare(room(bundle, light_group="others"))


def test_nobody_pays_who_did_not_ask(bundle: Path) -> None:
    integrator = mi.load_dict({"type": "purelight"})
    assert integrator.prepare(room(bundle)).groups == ()
    assert integrator.aov_names() == []


def test_groups_within_another_integrator_are_refused(bundle: Path) -> None:
    inner = {"type": "purelight", "light_groups": True, "max_depth": 2}
    nested = mi.load_dict({"type": "aov", "aovs": "depth:depth", "inner": inner})
    with pytest.raises(RuntimeError) as caught:
        mi.render(room(bundle), integrator=nested, spp=2)
    assert "light_groups does not work" in str(caught.value.__cause__)
    inner["light_groups"] = False
    nested = mi.load_dict({"type": "aov", "aovs": "depth:depth", "inner": inner})
    assert mi.render(room(bundle), integrator=nested, spp=2).shape[-1] == 4


def test_names_may_be_asked_for_early(bundle: Path) -> None:
    """As long as nobody relies on them: here the scene's own integrator is asked."""
    own = {"integrator": {"type": "purelight", "light_groups": True, "max_depth": 2}}
    scene = mi.load_dict(lamps.room() | own | {
        "lamp": {"type": "purelight", "filename": str(bundle), "to_world": PLACES["a"]},
    })  # fmt: skip
    assert scene.integrator().aov_names() == []
    assert mi.render(scene, spp=2).shape[-1] == 3 + 2 * 3


def test_names_may_be_asked_for_before_a_picture_by_an_integrator_of_no_scene(bundle: Path) -> None:
    integrator = mi.load_dict({"type": "purelight", "light_groups": True, "max_depth": 2})
    assert integrator.aov_names() == []
    assert mi.render(room(bundle), integrator=integrator, spp=2).shape[-1] == 3 + 3 * 3
