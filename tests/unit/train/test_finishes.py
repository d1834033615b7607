"""What a lamp's materials are made into: colours of even light, and bodies that scatter."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from purelight_format.color import LUMINANCE
from purelight_format.members.finishes import NONE

GLASS = '<bsdf type="roughdielectric"><float name="alpha" value="0.4"/></bsdf>'
BLACK = (
    '<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.02"/></bsdf>'
    "</bsdf>"
)
GLOW = (
    '<shape type="sphere" id="led"><float name="radius" value="0.01"/><point name="center" '
    'x="0" y="0" z="-0.3"/><emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>'
)
MATERIALS: dict[str, dict[str, Any]] = {
    "paint": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.4, 0.1]}},
    "plastic": {
        "type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": [0.1, 0.5, 0.3]},
    },
    "rough plastic": {"type": "roughplastic", "alpha": 0.25},
    "mirror": {"type": "conductor", "material": "Ag"},
    "copper": {"type": "roughconductor", "material": "Cu", "alpha": 0.3, "distribution": "ggx"},
    "rough gold": {"type": "roughconductor", "material": "Au", "alpha": 0.1},
    "principled": {
        "type": "principled", "base_color": {"type": "rgb", "value": [0.2, 0.3, 0.8]},
        "roughness": 0.5,
    },
    "glass": {"type": "dielectric", "int_ior": 1.5},
}  # fmt: skip


@pytest.mark.parametrize("name", MATERIALS)
def test_a_finish_reflects_as_much_of_even_light_as_its_material(name: str, mitsuba: Any) -> None:
    from purelight_train.light.finish_fit import finish_of, reflected_of_even
    from purelight_train.light.interfaces import relative_index
    from purelight_train.light.material_probe import DIFFUSE, GLOSSY, MIRRORED, Material

    bsdf = mitsuba.load_dict(MATERIALS[name])
    material = Material(bsdf, np.full((1, 2), 0.5), front=True)
    finish = finish_of(material, name, relative_index(bsdf), smooth=False)
    true = material.ask().part(MIRRORED, GLOSSY, DIFFUSE)
    np.testing.assert_allclose(reflected_of_even(finish), true, atol=0.02)
    assert finish.opaque == (name != "glass")
    assert (finish.metalness > 0.5) == (name in ("mirror", "copper", "rough gold"))
    assert (finish.ior == 1) == (name == "paint" or finish.metalness > 0.5)


@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.5])
def test_a_finish_is_as_rough_as_its_material(alpha: float, mitsuba: Any) -> None:
    from purelight_train.light.finish_fit import finish_of
    from purelight_train.light.material_probe import Material

    bsdf = {"type": "roughconductor", "distribution": "ggx", "alpha": alpha}
    material = Material(mitsuba.load_dict(bsdf), np.zeros((1, 2)), front=True)
    finish = finish_of(material, "", 1.0, smooth=False)
    assert finish.roughness**2 == pytest.approx(alpha, rel=0.15)


def lamp(path: Path, *shapes: str) -> Any:
    from purelight_train.light.finishes import finished
    from purelight_train.light.luminaire import load_luminaire

    path.write_text(f'<scene version="3.0.0">{GLOW}{"".join(shapes)}</scene>')
    luminaire = load_luminaire(path)
    return luminaire, finished(luminaire)


def ball(x: float) -> str:
    return (
        '<shape type="sphere"><float name="radius" value="0.1"/><point name="center" y="0" z="0" '
        f'x="{x}"/><ref id="glass"/></shape>'
    )


def box(x: float) -> str:
    """A black box, open above, deep enough for a ball."""
    walls = [
        f'<translate x="{x}" z="-0.2"/>',
        *(f'<rotate y="1" angle="90"/><translate x="{x + side}"/>' for side in (-0.2, 0.2)),
        *(f'<rotate x="1" angle="90"/><translate x="{x}" y="{side}"/>' for side in (-0.2, 0.2)),
    ]
    return "".join(
        f'<shape type="rectangle"><transform name="to_world"><scale value="0.2"/>{wall}</transform>'
        f"{BLACK}</shape>"
        for wall in walls
    )


def of_ball(luminaire: Any, found: Any, x: float) -> Any:
    """The finish of the ball at a place."""
    surface = luminaire.exit_surface
    middle = surface.positions[surface.triangles].mean(1)
    near = np.linalg.norm(middle - np.array([x, 0, 0]), axis=1) < 0.11
    index = np.unique(found.sides[near, 0])
    assert len(index) == 1
    assert index[0] != NONE
    return found.finishes[index[0]]


def test_a_body_in_the_dark_has_a_finish_of_its_own(mitsuba: Any, tmp_path: Path) -> None:
    named = GLASS.replace("<bsdf ", '<bsdf id="glass" ', 1)
    free, twin, boxed = -0.5, 0.0, 0.6
    parts = (named, ball(free), ball(twin), ball(boxed), box(boxed))
    luminaire, found = lamp(tmp_path / "lamp.xml", *parts)
    finishes = [of_ball(luminaire, found, x) for x in (free, twin, boxed)]
    ahead, back = ([LUMINANCE @ getattr(f, name) for f in finishes]
                   for name in ("scattered_ahead", "scattered_back"))  # fmt: skip
    assert ahead[0] + back[0] == pytest.approx(ahead[1] + back[1], abs=0.05)
    assert ahead[2] + back[2] < 0.5 * (ahead[0] + back[0])


def test_bodies_that_are_alike_share_a_finish(mitsuba: Any, tmp_path: Path) -> None:
    named = GLASS.replace("<bsdf ", '<bsdf id="glass" ', 1)
    luminaire, found = lamp(tmp_path / "lamp.xml", named, ball(-2.0), ball(0.0), ball(2.0))
    assert of_ball(luminaire, found, -2.0) == of_ball(luminaire, found, 2.0)
    own = of_ball(luminaire, found, 0.0)
    total = np.array(own.scattered_ahead) + own.scattered_back
    assert (total > 0.05).all()
    assert (total <= 1).all()


def test_bodies_hang_together_by_corners_and_material(mitsuba: Any, tmp_path: Path) -> None:
    from purelight_train.light.finish_bodies import bodies

    boxes = [trimesh.creation.box().apply_translation([x, 0, 0]) for x in (0, 5, 1)]
    trimesh.util.concatenate(boxes[:2]).export(tmp_path / "two.ply")
    boxes[2].export(tmp_path / "beside.ply")  # Shares a face with the first.
    parts = {
        name: {"type": "ply", "filename": str(tmp_path / f"{file}.ply"), "bsdf": {"type": kind}}
        for name, file, kind in (
            ("two", "two", "diffuse"), ("same", "two", "conductor"), ("beside", "beside", "diffuse")
        )
    }  # fmt: skip
    label = bodies(mitsuba.load_dict({"type": "scene"} | parts, optimize=False))
    assert label.shape == (60,)
    assert len(np.unique(label)) == 5
    assert all(len(set(each)) == 1 for each in label.reshape(5, 12))
    joined = mitsuba.load_dict({"type": "diffuse"})
    for part in parts.values():
        part["bsdf"] = joined
    label = bodies(mitsuba.load_dict({"type": "scene"} | parts, optimize=False))
    first, second, again, other, beside = label.reshape(5, 12)[:, 0]
    assert first == again == beside
    assert second == other != first
