"""Polygons cut into triangles that fill them, whatever their shape."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_mitsuba.usd_scene import cutting, ears
from purelight_mitsuba.usd_scene.corners import fans
from purelight_mitsuba.usd_scene.polygons import Polygons

NONE = np.zeros(0, np.int64)
DART = [(0, 0), (2, -1), (0, 3), (-2, -1)]
U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
KEYHOLE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
STEPS = [(0, 0), (3, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3)]


def star(tips: int) -> np.ndarray:
    """A polygon [2 tips, 2] whose corners all see the origin."""
    angle = np.arange(2 * tips) * np.pi / tips
    far = np.where(np.arange(2 * tips) % 2, 1, 0.5)
    return far[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)


def spiral(steps: int) -> np.ndarray:
    """A band [2 steps, 2] that winds around the origin three times."""
    angle = np.linspace(0, 6 * np.pi, steps)
    ring = np.stack([np.cos(angle), np.sin(angle)], 1)
    return np.concatenate([ring * (2 + angle)[:, None], (ring * (1 + angle)[:, None])[::-1]])


def radial(rng: np.random.Generator) -> np.ndarray:
    """A random polygon [N, 2] around the origin."""
    count = rng.integers(4, 40)
    angle = (np.arange(count) + rng.uniform(0, 0.9, count)) * 2 * np.pi / count
    return rng.uniform(0.05, 1, (count, 1)) * np.stack([np.cos(angle), np.sin(angle)], 1)


def in_space(flat: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A polygon [N, 2] in a random plane: [N, 3]."""
    basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return flat @ basis[:2] + rng.normal(size=3)


def newell(at: np.ndarray) -> np.ndarray:
    """A polygon's normal, as long as its area."""
    return 0.5 * np.cross(at - at[0], np.roll(at, -1, 0) - at[0]).sum(0)


def cut(at: np.ndarray) -> np.ndarray:
    """Corners [N - 2, 3] of the triangles of a polygon [N, 3]."""
    return cutting.cut(np.array([len(at)]), np.arange(len(at)), at)[1]


def fan(count: int) -> np.ndarray:
    return fans(np.array([count]))[1]


def fills(at: np.ndarray, corner: np.ndarray) -> bool:
    """Whether triangles are wound as their polygon, and have its area."""
    a, b, c = np.moveaxis(at[corner], 1, 0)
    area = 0.5 * np.cross(b - a, c - a)
    normal = newell(at)
    total = np.linalg.norm(normal)
    wound = area @ normal >= -1e-9 * total**2
    return bool(wound.all()) and np.isclose(np.linalg.norm(area, axis=1).sum(), total)


@pytest.mark.parametrize("turned", [False, True], ids=["", "turned"])
@pytest.mark.parametrize(
    "shape",
    [DART, U, KEYHOLE, STEPS, star(4), star(5), star(40), spiral(60), np.repeat(U, 2, 0)],
    ids=["dart", "U", "keyhole", "steps", "four", "five", "forty", "spiral", "twice"],
)
def test_triangles_fill_their_polygon_from_any_corner(
    shape: list[tuple[float, float]], turned: bool
) -> None:
    at = in_space(np.array(shape, float)[:: -1 if turned else 1], np.random.default_rng(3))
    for first in range(len(at)):
        rolled = np.roll(at, first, 0)
        assert fills(rolled, cut(rolled)), first


def test_triangles_fill_random_polygons() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        at = in_space(radial(rng)[:: rng.choice([-1, 1])], rng)
        corner = cut(at)
        assert fills(at, corner), at
        assert len(corner) == len(at) - 2
        rough = at.astype(np.float32).astype(float)  # Nearly in one plane
        corner = cut(rough)
        assert cutting._folded(np.zeros(len(corner), int), rough[corner], 1) < 1e-6, rough


def test_corners_in_a_row_along_edges() -> None:
    rng = np.random.default_rng(6)
    for _ in range(50):
        some = radial(rng)
        share = np.linspace(0, 1, 4, endpoint=False)[:, None]
        along = [a + share * (b - a) for a, b in zip(some, np.roll(some, -1, 0), strict=True)]
        at = in_space(np.concatenate(along), rng)
        assert fills(at, cut(at))


@pytest.mark.parametrize("count", [3, 4, 5, 12])
def test_convex_polygons_are_fans(count: int) -> None:
    angle = np.arange(count) * 2 * np.pi / count
    ring = np.stack([np.cos(angle), np.sin(angle)], 1)
    for at in (ring, ring[::-1], np.repeat(ring, 2, 0)):
        for first in range(len(at)):
            placed = in_space(np.roll(at, first, 0), np.random.default_rng(first))
            np.testing.assert_array_equal(cut(placed), fan(len(at)))


def test_a_square_with_its_edges_parted_is_a_fan() -> None:
    """What rounding does to corners in a row is no reason to cut otherwise."""
    ends = np.arange(0, 17, 4)
    x, y = (np.interp(np.arange(16), ends, c) for c in ([0, 1, 1, 0, 0], [0, 0, 1, 1, 0]))
    square = np.stack([x, y], 1)
    at = in_space(square, np.random.default_rng(1)).astype(np.float32).astype(float)
    np.testing.assert_array_equal(cut(at), fan(16))


def test_only_the_polygons_that_need_it_are_cut_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of two corners make no triangle; blocks do not matter."""
    shapes = [star(5), np.array(DART)[[1, 2, 3, 0]], star(2)[:2], np.array(U), spiral(9)[:3]] * 3
    counts = np.array([len(s) for s in shapes])
    at = np.concatenate([in_space(s, np.random.default_rng(2)) for s in shapes])
    vertex = np.random.default_rng(0).permutation(len(at))
    position = np.empty_like(at)
    position[vertex] = at
    face, corner = cutting.cut(counts, vertex, position)
    np.testing.assert_array_equal(face, fans(counts)[0])
    start = np.cumsum(counts) - counts
    alone = [k + cut(at[k : k + n]) for k, n in zip(start, counts, strict=True)]
    np.testing.assert_array_equal(corner, np.concatenate(alone))
    monkeypatch.setattr(cutting, "BLOCK", 2)
    np.testing.assert_array_equal(cutting.cut(counts, vertex, position)[1], corner)


@pytest.mark.parametrize(
    "shape",
    [
        [(0, 0)] * 6, [(0, 0), (1, 0), (2, 0), (3, 0), (1.5, 0)], [(0, 0), (2, 2), (2, 0), (0, 3)],
        [(0, 0), (4, 3), (4, 0), (3, 0), (0, 5)], [(0, 0), (4, 3), (5, 1), (4, 0), (0, 5), (-1, 3)],
        [(np.nan, 0), (1, 0), (1, 1), (0.9, 0.1), (0, 1)],
        [(0, 0), (np.inf, 0), (1, 1), (0.9, 0.1), (0, 1)],
        [(1e200 * x, 1e200 * y) for x, y in U], [(1e-200 * x, 1e-200 * y) for x, y in U],
        [(np.cos(k * 1.6 * np.pi / 2), np.sin(k * 1.6 * np.pi / 2)) for k in range(5)],
    ],
    ids=["point", "line", "bow", "eight", "wide eight", "nan", "inf", "huge", "tiny", "pentagram"],
)  # fmt: skip
def test_what_has_no_inside_stays_a_fan(shape: list[tuple[float, float]]) -> None:
    at = np.pad(np.array(shape, float), ((0, 0), (0, 1)))
    np.testing.assert_array_equal(cut(at), fan(len(at)))


def test_polygons_of_very_many_corners_stay_fans(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ears, "MOST_CORNERS", 119)
    at = in_space(spiral(60), np.random.default_rng(0))
    np.testing.assert_array_equal(cut(at), fan(120))


def test_random_corners_do_not_stop_it() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        at = rng.integers(0, 4, (rng.integers(4, 30), 3)).astype(float)
        corner = cut(at)
        assert corner.shape == (len(at) - 2, 3)
        assert set(corner.ravel()) == set(range(len(at)))


def test_values_follow_the_corners() -> None:
    at = np.roll(np.array(U, float), 2, 0)
    vertex = np.array([7, 3, 1, 0, 2, 6, 5, 4])
    position = np.zeros((8, 3))
    position[vertex, :2] = at
    normal = np.pad(at, ((0, 0), (0, 1)), constant_values=1)
    mesh = Polygons(np.array([8]), vertex, position, np.array([4]), normal, at)
    found = mesh.triangles(NONE)
    assert not np.array_equal(found.position, position[vertex[fan(8)]])
    assert found.normal is not None
    assert found.uv is not None
    np.testing.assert_array_equal(found.uv, found.position[..., :2])
    np.testing.assert_array_equal(found.normal[..., :2], found.position[..., :2])
    assert found.face.tolist() == [4] * 6
    assert len(mesh.triangles(np.array([4])).face) == 0
