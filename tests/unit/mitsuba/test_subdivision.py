"""Subdivision surfaces against what is known of their limits, and against another program."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from purelight_mitsuba.subdivision import Cage, refine
from purelight_mitsuba.subdivision.refine import FACES, LEVELS, level

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SIDES = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
FACETS = [0, 1, 2, 1, 3, 2, 3, 4, 2, 4, 0, 2, 1, 0, 5, 3, 1, 5, 4, 3, 5, 0, 4, 5]


def cage(
    corners: int,
    vertex: list[int] | np.ndarray,
    size: int,
    crease: np.ndarray | None = None,
    sharpness: float = 0.0,
    corner: np.ndarray | None = None,
) -> Cage:
    crease = np.zeros((0, 2), np.int64) if crease is None else crease
    counts = np.full(len(vertex) // corners, corners)
    corner = np.zeros(size) if corner is None else corner
    return Cage(counts, np.array(vertex), size, crease, np.full(len(crease), sharpness), corner)


def cube(sharpness: float = 0.0) -> Cage:
    return cage(4, SIDES, 8, cage(4, SIDES, 8).edges, sharpness)


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Quadrangles of an n x n grid, and the places of its vertices."""
    at = np.array([[i, j, 0] for j in range(n) for i in range(n)], float)
    first = np.array([j * n + i for j in range(n - 1) for i in range(n - 1)])
    return np.stack([first, first + 1, first + n + 1, first + n], 1).ravel(), at


def test_the_cube_s_corners_go_where_the_formula_says() -> None:
    found = refine(cube(), CUBE, 3).position[:8]
    np.testing.assert_allclose(found, (9 + 4 - 1) / (3 * 8) * CUBE)  # (n²v + 4Σe + Σf) / n(n+5)


def test_inside_a_grid_it_is_a_cubic_spline() -> None:
    vertex, at = grid(5)
    at[:, 2] = np.random.default_rng(0).normal(size=25)
    found = refine(cage(4, vertex, 25), at, 2).position[12, 2]
    spline = np.array([1, 4, 1]) / 6
    height = at[:, 2].reshape(5, 5)
    np.testing.assert_allclose(found, spline @ height[1:4, 1:4] @ spline)
    np.testing.assert_allclose(
        refine(cage(4, vertex, 25), at, 1).position[2, 2], spline @ height[0, 1:4]
    )


@pytest.mark.parametrize("scheme", ["catmullClark", "loop"])
def test_every_level_lies_on_the_same_surface(scheme: str) -> None:
    corners, faces, at = (3, FACETS, OCTAHEDRON) if scheme == "loop" else (4, SIDES, CUBE)
    shape = cage(corners, faces, len(at))
    coarse, fine = (refine(shape, at, n, scheme=scheme).position for n in (1, 4))
    np.testing.assert_allclose(fine[: len(coarse)], coarse, atol=1e-12)
    radius = np.linalg.norm(fine, axis=1)
    assert 0.8 < radius.min() / radius.max() < 1


def test_a_level_of_loop_is_that_of_another_program() -> None:
    """The last face is left out, so that the surface has a boundary."""
    from purelight_mitsuba.subdivision import loop

    faces = np.array(FACETS[:-3]).reshape(-1, 3)
    fine, found = loop.step(cage(3, faces.ravel(), 6), OCTAHEDRON)
    theirs, triangles = trimesh.remesh.subdivide_loop(OCTAHEDRON, faces, 1)
    ours, theirs = (np.unique(np.round(points, 8), axis=0) for points in (found, theirs))
    np.testing.assert_allclose(ours, theirs)
    assert len(fine.counts) == len(triangles)


def test_creases_end_after_as_many_levels_as_they_are_sharp() -> None:
    reach = [np.linalg.norm(refine(cube(s), CUBE, 5).position[7]) for s in (0, 0.5, 1, 2, 4, 10)]
    assert np.all(np.diff(reach) > 0)
    np.testing.assert_allclose(reach[1], (reach[0] + reach[2]) / 2)
    np.testing.assert_allclose(reach[-1], np.sqrt(3))


def test_sharp_edges_part_the_normals() -> None:
    sharp = refine(cube(10), CUBE, 2)
    np.testing.assert_allclose(np.abs(sharp.position).max(1), 1)
    np.testing.assert_allclose(np.abs(sharp.normal).max(1), 1, atol=1e-9)
    ring = np.array([[1, 5], [5, 7], [7, 3], [3, 1]])
    cup = refine(cage(4, SIDES, 8, ring, 10.0), CUBE, 3)
    rim = np.isclose(cup.position[cup.vertex][:, 2], 1)
    up = np.isclose(cup.normal[rim][:, 2], 1)
    assert up.any()
    assert not up.all()
    smooth = refine(cube(), CUBE, 3)
    corner = smooth.normal[smooth.vertex == 7]
    np.testing.assert_allclose(corner, np.full((3, 3), 3**-0.5), atol=1e-12)


def test_normals_point_outwards() -> None:
    for corners, faces, at, scheme in (
        (4, SIDES, CUBE, "catmullClark"),
        (3, FACETS, OCTAHEDRON, "loop"),
    ):
        fine = refine(cage(corners, faces, len(at)), at, 3, scheme=scheme)
        assert ((fine.position[fine.vertex] * fine.normal).sum(1) > 0.1).all()


@pytest.mark.parametrize(
    "rule", ["all", "none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "vertex"]
)
def test_pictures_stay_on_a_flat_sheet(rule: str) -> None:
    """Its corners are sharp, so texture coordinates that are places stay places."""
    vertex, at = grid(4)
    corner = np.zeros(16)
    corner[[0, 3, 12, 15]] = 10
    shape = cage(4, vertex, 16, corner=corner)
    fine = refine(shape, at, 3, uv=at[vertex][:, :2], uv_rule=rule)
    np.testing.assert_allclose(fine.uv, fine.position[fine.vertex][:, :2], atol=1e-12)


def seam(rule: str) -> np.ndarray:
    """Texture coordinates where two islands meet: those of the left one at the right edge."""
    vertex, at = grid(5)
    uv = at[vertex][:, :2].copy()
    right = np.repeat(at[vertex].reshape(-1, 4, 3)[:, :, 0].mean(1) > 2, 4)
    uv[right] += [10, 0]
    uv[(uv[:, 0] == 2) & (uv[:, 1] == 2)] += [0.5, 0]  # A notch in the seam of the left island.
    fine = refine(cage(4, vertex, 25), at, 3, uv=uv, uv_rule=rule)
    here = (fine.uv[:, 0] < 8) & np.isclose(fine.position[fine.vertex][:, 0], 2, atol=1e-9)
    return fine.uv[here][:, 0].max()


def test_seams_bend_unless_they_are_linear() -> None:
    linear, pinned, smooth = (seam(rule) for rule in ("all", "boundaries", "cornersPlus1"))
    np.testing.assert_allclose([linear, pinned], 2.5)
    np.testing.assert_allclose(smooth, 2 + 0.5 * 4 / 6)  # A cubic spline along the seam.


def test_polygons_know_whose_they_are() -> None:
    counts, vertex = np.array([3, 4, 5]), np.array([0, 1, 2, 2, 1, 3, 4, 4, 3, 5, 6, 7])
    at = np.random.default_rng(1).normal(size=(8, 3))
    none = np.zeros((0, 2), np.int64)
    fine = refine(Cage(counts, vertex, 8, none, np.zeros(0), np.zeros(8)), at, 2)
    assert np.bincount(fine.parent).tolist() == [12, 16, 20]
    assert len(fine.vertex) == fine.counts.sum() == 4 * 48


def test_the_rule_for_triangles_changes_them_alone() -> None:
    triangles, quads = cage(3, FACETS, 6), cube()
    plain, smooth = (refine(triangles, OCTAHEDRON, 2, smooth_triangles=s).position for s in (0, 1))
    assert np.abs(plain - smooth).max() > 0.01
    same = (refine(quads, CUBE, 2, smooth_triangles=s).position for s in (False, True))
    np.testing.assert_array_equal(*same)


def test_bilinear_surfaces_stay_where_they_are() -> None:
    fine = refine(cube(), CUBE, 3, scheme="bilinear")
    np.testing.assert_allclose(np.abs(fine.position).max(1), 1)
    assert fine.normal is None
    assert len(fine.counts) == 6 * 64


def test_levels_are_bounded() -> None:
    assert level(6) == LEVELS
    for faces, copies in ((6, 1), (1000, 1), (200_000, 1), (20, 10_000), (1, 10**6)):
        n = level(faces, copies)
        assert n >= 1
        assert n == 1 or faces * 4**n <= FACES
    assert level(20, 10_000) < level(20, 1)


def test_edges_of_three_polygons_stay_sharp() -> None:
    at = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0.5, 0], [-1, -0.5, 0]], float)
    shape = cage(3, [0, 1, 2, 0, 1, 3, 0, 1, 4], 5)
    fine = refine(shape, at, 2)
    assert np.isfinite(fine.position).all()
    np.testing.assert_allclose(fine.position[0], at[0])
