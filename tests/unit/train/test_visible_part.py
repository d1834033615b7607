"""What is seen of a lamp from outside: rays that meet its triangles, and rays that leave them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from tests.support.irradiance import FORM_FACTOR

RAYS = 1 << 18
SIGNIFICANCE = 0.001


def box(*size: float) -> tuple[Any, Any]:
    """Corners [8, 3] and triangles [12, 3] of a box about the origin."""
    import trimesh

    mesh = trimesh.creation.box(size)
    return np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32)


def test_uniform_lines_meet_a_convex_body_by_area(mitsuba: Any) -> None:
    """Cauchy and Crofton: in proportion to area, S / (4 pi R^2) of all; its back never."""
    from scipy.stats import binomtest, chisquare

    from purelight_train.light.exit_surface import ExitSurface
    from purelight_train.light.visible_part import _met

    corners, faces = box(1, 2, 0.1)
    far = corners + np.float32([30, -20, 10])
    surface = ExitSurface(far, faces, np.zeros(len(faces), bool))
    front, back = _met(surface, RAYS, np.random.default_rng(0))
    assert back.sum() <= 1e-4 * RAYS  # through rounding, at edges
    share = surface.triangle_area / surface.area
    assert chisquare(front, front.sum() * share).pvalue > SIGNIFICANCE
    sphere = 4 * np.pi * surface.sphere.radius**2 * 1.0001**2
    assert binomtest(int(front.sum()), RAYS, surface.area / sphere).pvalue > SIGNIFICANCE


def test_rays_leave_a_square_beside_what_faces_it(
    mitsuba: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of its back, and of its front what the form factor of the two leaves."""
    from scipy.stats import binomtest

    from purelight_train.light import visible_part
    from purelight_train.light.exit_surface import ExitSurface

    each = 1 << 16
    monkeypatch.setattr(visible_part, "PER_TRIANGLE", (each, each))
    square = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    corners = np.concatenate([square, square + np.float32([0, 0, 1])])
    faces = np.array([[0, 1, 2], [0, 2, 3], [6, 5, 4], [7, 6, 4]], np.uint32)
    surface = ExitSurface(corners, faces, np.zeros(4, bool))
    front, back = visible_part._leaving(surface, np.arange(4), np.random.default_rng(0))
    assert (back == each).all()
    for lower in (front[:2].sum(), front[2:].sum()):
        assert binomtest(int(lower), 2 * each, 1 - FORM_FACTOR).pvalue > SIGNIFICANCE


def test_nothing_leaves_a_closed_box(mitsuba: Any) -> None:
    """A bulb within it is left out, and the box is seen from outside alone."""
    from purelight_train.light.visible_part import visible_part

    outer, faces = box(1, 1, 1)
    inner, more = box(0.3, 0.3, 0.3)
    both = np.concatenate([outer, inner]), np.concatenate([faces, more + np.uint32(len(outer))])
    surface = visible_part(*both, None, RAYS, np.random.default_rng(0))
    assert len(surface.triangles) == 12
    assert surface.area == pytest.approx(6)
    assert not surface.two_sided.any()


def test_batches_are_of_other_rays(mitsuba: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as asked for, none twice, and the same for the same seed."""
    from purelight_train.light import visible_part

    monkeypatch.setattr(visible_part, "RAY_BATCH", 1000)

    def drawn() -> tuple[Any, Any]:
        batches = visible_part._batches(2500, np.random.default_rng(3))
        parts = [(np.array(number), np.array(s.next_1d())) for number, s in batches]
        number, value = (np.concatenate(column) for column in zip(*parts, strict=True))
        return number, value

    (number, value), (_, again) = drawn(), drawn()
    np.testing.assert_array_equal(number, np.arange(2500))
    assert len(np.unique(value)) > 2490
    np.testing.assert_array_equal(value, again)


def test_copies_and_slivers_are_left_out(mitsuba: Any) -> None:
    """A cube with each face twice, once the other way round, and with empty triangles."""
    from purelight_train.light.visible_part import visible_part

    corners, faces = box(1, 1, 1)
    empty = np.array([[0, 0, 1], [2, 2, 2]], np.uint32)
    doubled = np.concatenate((faces, faces[:, ::-1] + len(corners), empty))
    rng = np.random.default_rng(0)
    surface = visible_part(np.concatenate((corners, corners)), doubled, None, 1 << 14, rng)
    assert len(surface.triangles) == 12
    assert surface.area == pytest.approx(6)
    position, normal = surface.sample(1000, rng)
    assert (np.einsum("nd,nd->n", position, normal) > 0.49).all()
    with pytest.raises(PureLightError, match="no area"):
        visible_part(corners, empty, None, 1 << 10, rng)
