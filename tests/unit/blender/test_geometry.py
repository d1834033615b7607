"""Which surfaces are closed and convex, and triangles in bins of like radiance; no Blender."""

from __future__ import annotations

import numpy as np
import trimesh

from purelight_blender import convexity
from purelight_blender.flux_bins import bins, moment


def outward(mesh: trimesh.Trimesh, *, turn: bool = False) -> np.ndarray | None:
    faces = mesh.faces.copy()
    if turn:
        faces[::3] = faces[::3, ::-1]
    return convexity.outward(np.asarray(mesh.vertices, np.float32), faces)


def test_a_ball_and_a_box_are_convex_whatever_their_winding() -> None:
    for mesh in (trimesh.creation.icosphere(3), trimesh.creation.box((1, 2, 0.1))):
        found = outward(mesh, turn=True)
        assert found is not None
        assert trimesh.Trimesh(mesh.vertices, found, process=False).volume > 0


def test_open_hollow_dented_and_several_are_not() -> None:
    ball = trimesh.creation.icosphere(2)
    open_ball = trimesh.Trimesh(ball.vertices, ball.faces[1:], process=False)
    dented = ball.copy()
    dented.vertices[0] *= 0.7
    inner = ball.copy()
    inner.apply_scale(0.5)
    beside = ball.copy()
    beside.apply_translation([3, 0, 0])
    for mesh in (open_ball, dented, ball + inner, ball + beside, trimesh.creation.torus(2, 1)):
        assert outward(mesh) is None


def test_even_light_is_one_bin_and_uneven_light_a_few() -> None:
    rng = np.random.default_rng(0)
    area = rng.uniform(0.5, 2, 1000)
    none = np.zeros(1000, bool)
    even = bins(area, area[:, None] * [3, 2, 1.0], none)
    assert even.sides == ("FRONT",)
    uneven = (area * 10 ** rng.uniform(-4, 2, 1000))[:, None] * [3, 2, 1.0]
    found = bins(area, uneven, none)
    assert 2 <= len(found.sides) <= 6
    power = uneven @ [0.2126, 0.7152, 0.0722]
    alike = bins(area, area[:, None] * np.ones(3), none)
    assert moment(area, power, found) < 1.4 < 2.5 < moment(area, power, alike)


def test_what_shines_to_both_sides_is_apart_unless_it_is_little() -> None:
    area, flux, both = np.ones(100), np.ones((100, 3)), np.arange(100) < 50
    assert bins(area, flux, both).sides == ("FRONT", "FRONT_BACK")
    assert bins(area, flux, np.arange(100) < 2).sides == ("FRONT",)


def test_no_light_is_aimed_at_nowhere() -> None:
    dark = bins(np.ones(4), np.zeros((4, 3)), np.zeros(4, bool))
    assert dark.sides == ("NONE",)
    assert (dark.strength > 0).all()
