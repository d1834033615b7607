"""Exit surfaces with fewer triangles: within the tolerance, with borders, gaps and parts kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from purelight_train.light.decimation import decimated
from purelight_train.light.exit_surface import ExitSurface, inward_rays
from purelight_train.light.finishes import finished
from purelight_train.light.lighter import chosen_of, lighter
from purelight_train.light.luminaire import load_luminaire

pytestmark = pytest.mark.usefixtures("mitsuba")
TOLERANCE = 2e-3


def surface(*meshes: trimesh.Trimesh, two_sided: bool = False) -> ExitSurface:
    """Meshes as they are, one after another."""
    whole = trimesh.util.concatenate(list(meshes))
    triangles = np.asarray(whole.faces, np.uint32)
    sides = np.full(len(triangles), two_sided)
    return ExitSurface(np.asarray(whole.vertices, np.float32), triangles, sides)


def mesh(found: ExitSurface) -> trimesh.Trimesh:
    return trimesh.Trimesh(found.positions, found.triangles, process=True)


def moved(one: ExitSurface, other: ExitSurface) -> float:
    """The largest distance of points of either from the other, over the first one's radius.

    The other's 40 triangles nearest by their corners and middles are asked.
    """
    result = 0.0
    for a, b in ((one, other), (other, one)):
        points = np.concatenate([a.sample(3000, np.random.default_rng(1))[0], a.positions])
        corner = b.positions[b.triangles].astype(np.float64)
        places = np.concatenate([corner.mean(1), *np.moveaxis(corner, 1, 0)])
        near = cKDTree(places).query(points, k=40)[1] % len(corner)
        closest = trimesh.triangles.closest_point(
            corner[near].reshape(-1, 3, 3), np.repeat(points, 40, axis=0)
        )
        away = np.linalg.norm(closest.reshape(len(points), 40, 3) - points[:, None], axis=2)
        result = max(result, float(away.min(1).max()))
    return result / one.sphere.radius


def sheet(side: int, holes: float = 0.0) -> trimesh.Trimesh:
    """A square of side 1 in the plane z = 0, with square holes over part of each cell's side."""
    lines = np.linspace(0, 1, side + 1)
    if holes:
        half = 0.5 * holes / side
        middle = (np.arange(side) + 0.5) / side
        lines = np.sort(np.concatenate([lines, middle - half, middle + half]))
    x, y = np.meshgrid(lines, lines, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    n = len(lines)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij"))
    if holes:
        solid = (i % 3 != 1) | (j % 3 != 1)
        i, j = i[solid], j[solid]
    a, b, c, d = i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1
    return trimesh.Trimesh(
        vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    )


def test_a_plane_becomes_few_triangles_with_its_outline() -> None:
    plane = surface(sheet(30), two_sided=True)
    found = decimated(plane, TOLERANCE)
    assert len(found.triangles) < 40
    assert found.area == pytest.approx(plane.area, rel=1e-6)
    assert found.two_sided.all()


def test_a_box_keeps_its_edges() -> None:
    box = surface(trimesh.creation.box().subdivide().subdivide().subdivide().subdivide())
    found = decimated(box, TOLERANCE)
    assert len(found.triangles) < 0.05 * len(box.triangles)
    assert mesh(found).is_watertight
    assert mesh(found).volume == pytest.approx(1, rel=1e-6)


@pytest.mark.parametrize(("tolerance", "left"), [(1e-3, 0.9), (2e-3, 0.4)])
def test_a_ball_stays_within_the_tolerance(tolerance: float, left: float) -> None:
    ball = surface(trimesh.creation.icosphere(subdivisions=5))
    found = decimated(ball, tolerance)
    assert len(found.triangles) < left * len(ball.triangles)
    assert moved(ball, found) <= tolerance
    assert mesh(found).is_watertight
    assert set(map(tuple, found.positions)) <= set(map(tuple, ball.positions))


def test_nothing_is_lost_of_a_closed_lamp() -> None:
    torus = trimesh.creation.torus(1.0, 0.3, major_sections=192, minor_sections=96)
    whole = surface(torus)
    found = decimated(whole, TOLERANCE)
    assert len(found.triangles) < 0.3 * len(whole.triangles)
    assert mesh(found).is_watertight
    assert mesh(found).euler_number == 0
    rays = inward_rays(whole.sphere, 200_000, np.random.default_rng(0), cosine=True)
    before, after = whole.intersect(*rays), found.intersect(*rays)
    # A chord's outline lies inside: by the tolerance over the tube's radius at most
    assert len(after.index) == pytest.approx(len(before.index), rel=TOLERANCE * 1.3 / 0.3)
    assert after.front.all()


def test_holes_of_a_perforated_sheet_stay() -> None:
    sheet_ = surface(sheet(20, holes=0.4), two_sided=True)
    found = decimated(sheet_, TOLERANCE)
    assert found.area == pytest.approx(sheet_.area, rel=1e-4)
    assert mesh(found).euler_number == mesh(sheet_).euler_number
    assert len(found.triangles) < len(sheet_.triangles)


def test_thin_double_walls_do_not_cross() -> None:
    outer = trimesh.creation.icosphere(subdivisions=5)
    inner = trimesh.creation.icosphere(subdivisions=5, radius=1 - 0.5 * TOLERANCE)
    inner.apply_transform(trimesh.transformations.rotation_matrix(0.3, [1, 2, 3]))
    walls = surface(outer, inner)
    found = decimated(walls, TOLERANCE)
    origin, direction = inward_rays(walls.sphere, 100_000, np.random.default_rng(0), cosine=False)
    hits = found.intersect(origin, direction)
    radius = np.linalg.norm(found.positions[found.triangles], axis=2).mean(1)
    before = walls.intersect(origin, direction)
    radius_before = np.linalg.norm(walls.positions[walls.triangles], axis=2).mean(1)
    middle = 1 - 0.25 * TOLERANCE
    assert (radius_before[before.triangle] < middle).mean() == 0
    assert (radius[hits.triangle] < middle).mean() < 1e-4


def test_parts_far_apart_and_tiny_stay() -> None:
    parts = [
        trimesh.creation.icosphere(subdivisions=3, radius=1e-4).apply_translation([x, 0, 0])
        for x in (-10.0, 10.0)
    ]
    found = decimated(surface(*parts), TOLERANCE)
    assert mesh(found).body_count == 2
    assert mesh(found).is_watertight


def test_lines_between_labels_stay() -> None:
    plane = surface(sheet(30))
    middle = plane.positions[plane.triangles].mean(1)
    label = (middle[:, 0] > 0.5).astype(np.int64)
    named = replace(plane, source=np.arange(len(label)))
    found = decimated(named, TOLERANCE, label)
    assert found.source is not None
    left = found.positions[found.triangles][label[found.source] == 0]
    right = found.positions[found.triangles][label[found.source] == 1]
    assert len(left)
    assert left[..., 0].max() <= 0.5
    assert right[..., 0].min() >= 0.5


def test_what_has_a_negative_label_stays() -> None:
    plane = surface(sheet(10))
    found = decimated(plane, TOLERANCE, np.full(len(plane.triangles), -1))
    assert len(found.triangles) == len(plane.triangles)


def test_shading_normals_are_those_of_the_corners() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    smooth = replace(surface(ball), vertex_normals=np.asarray(ball.vertices, np.float32))
    found = decimated(smooth, 5e-3)
    assert found.vertex_normals is not None
    assert len(found.triangles) < len(smooth.triangles)
    np.testing.assert_allclose(found.vertex_normals, found.positions, atol=1e-5)


def test_degenerate_and_doubled_triangles_do_no_harm() -> None:
    box = trimesh.creation.box().subdivide().subdivide()
    faces = np.concatenate([box.faces, box.faces[:5], [[0, 0, 1], [2, 2, 2]]]).astype(np.uint32)
    found = decimated(
        ExitSurface(np.asarray(box.vertices, np.float32), faces, np.zeros(len(faces), bool)), 1e-3
    )
    assert np.isfinite(found.positions).all()
    assert mesh(found).area == pytest.approx(6, rel=1e-5)


def test_a_lamp_keeps_its_shapes_apart(lamp: Path) -> None:
    whole = load_luminaire(lamp)
    found = lighter(whole, 5e-3)
    assert len(found.exit_surface.triangles) < len(whole.exit_surface.triangles)
    made = finished(whole).sides[:, 0]
    sides = made[chosen_of(whole.exit_surface, found.exit_surface)]
    areas = [
        np.bincount(side, it.exit_surface.triangle_area, 256)
        for side, it in ((made, whole), (sides, found))
    ]
    np.testing.assert_allclose(*areas, rtol=0.03)


def test_zero_leaves_all_as_it_is() -> None:
    ball = surface(trimesh.creation.icosphere(subdivisions=2))
    assert decimated(ball, 0.0) is ball
