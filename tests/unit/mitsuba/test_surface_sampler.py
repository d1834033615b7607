"""Drawing points of exit surfaces: how often, where, and at which density per solid angle."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import trimesh
from scipy import stats

from purelight_format.members.surface import Surface
from purelight_mitsuba.sampling.surface_sampler import (
    DEFENSIVE,
    SHELL,
    SurfaceSampler,
    alias_table,
    probabilities,
    share,
)

COUNT = 1 << 18


def awkward() -> Surface:
    """A cone with a hole, some triangles dark, one twice, one without area, one turned over."""
    mesh = trimesh.creation.cone(radius=1, height=1.5, sections=12)
    faces = np.concatenate([mesh.faces[2:], mesh.faces[5:6], [[0, 0, 1]]])
    faces[7] = faces[7, ::-1]
    flux = np.random.default_rng(0).exponential(size=(len(faces), 3)).astype(np.float32)
    flux[::3] = 0
    return Surface(np.asarray(mesh.vertices, np.float32), faces.astype(np.uint32), flux)


def uniform(seed: int) -> mi.Point2f:
    return mi.Point2f(np.random.default_rng(seed).random((2, COUNT), np.float32))


def draw(surfaces: list[Surface], index: int) -> tuple[SurfaceSampler, np.ndarray, np.ndarray]:
    sampler = SurfaceSampler(surfaces)
    point = sampler.sample(mi.UInt32(index), uniform(1), uniform(2), mi.Bool(True))
    return sampler, np.array(point.position).T, np.array(point.facet)


def test_chances_follow_flux_and_area() -> None:
    surface = awkward()
    chance, area = probabilities(surface), surface.area()
    assert chance.sum() == pytest.approx(1)
    assert chance[-1] == 0
    dark = (surface.triangle_flux.sum(1) == 0) & (area > 0)
    assert dark.any()
    np.testing.assert_allclose(chance[dark], DEFENSIVE * area[dark] / area.sum())


def test_dark_surfaces_are_drawn_by_area() -> None:
    surface = awkward()
    dark = Surface(surface.positions, surface.triangles, 0 * surface.triangle_flux)
    np.testing.assert_allclose(probabilities(dark), surface.area() / surface.area().sum())
    flat = Surface(0 * surface.positions, surface.triangles, surface.triangle_flux)
    assert probabilities(flat).sum() == pytest.approx(1)


@pytest.mark.parametrize("chances", [[1.0], [0.0, 1.0], [0.7, 0.0, 0.1, 0.2], [0.25] * 4])
def test_alias_table_keeps_the_chances(chances: list[float]) -> None:
    threshold, alias = alias_table(np.array(chances))
    found = threshold.copy()
    np.add.at(found, alias, 1 - threshold)
    np.testing.assert_allclose(found / len(chances), chances, atol=1e-12)


@pytest.mark.parametrize("index", [0, 1])
def test_triangles_are_drawn_as_often_as_said(index: int) -> None:
    surfaces = [awkward(), Surface(awkward().positions, awkward().triangles[:5],
                                   awkward().triangle_flux[:5])]  # fmt: skip
    _, position, facet = draw(surfaces, index)
    expected = probabilities(surfaces[index]) * COUNT
    counts = np.bincount(facet, minlength=len(expected))
    lit = expected > 0
    assert (counts[~lit] == 0).all()
    assert stats.chisquare(counts[lit], expected[lit]).pvalue > 0.01
    corners = surfaces[index].positions[surfaces[index].triangles]
    for k in np.flatnonzero(lit)[:3]:
        mean = position[facet == k].mean(0)
        np.testing.assert_allclose(mean, corners[k].mean(0), atol=0.02)


@pytest.mark.parametrize("point", [(0.1, 0.2, 0.3), (0.9, 0.5, 0.2), (0.0, 0.0, 3.0)])
def test_density_per_solid_angle_counts_the_points_that_are_seen(
    point: tuple[float, ...],
) -> None:
    """∫ pdf over the directions that meet the surface = the chance that a drawn point is seen."""
    surface = awkward()
    sampler, position, facet = draw([surface], 0)
    scene = _scene(surface)
    origin = mi.Point3f(*point)

    ray = mi.Ray3f(origin, dr.normalize(mi.Point3f(position.T) - origin))
    met = scene.ray_intersect_preliminary(ray, active=mi.Bool(True))
    seen = np.array((met.prim_index == mi.UInt32(facet)) & met.is_valid())

    ray = mi.Ray3f(origin, mi.warp.square_to_uniform_sphere(uniform(3)))
    met = scene.ray_intersect(ray)
    pdf = sampler.pdf_solid_angle(
        mi.UInt32(0), met.prim_index, met.n, ray.d * met.t, met.is_valid()
    )
    pdf = np.array(dr.select(met.is_valid(), pdf, 0)) * 4 * math.pi
    error = math.hypot(seen.std(), pdf.std()) / math.sqrt(COUNT)
    assert abs(seen.mean() - pdf.mean()) < 4 * error
    assert error < 0.02


def _scene(surface: Surface) -> mi.Scene:
    mesh = mi.Mesh("surface", len(surface.positions), len(surface.triangles))
    params = mi.traverse(mesh)
    params["vertex_positions"] = surface.positions.ravel()
    params["faces"] = surface.triangles.ravel()
    params.update()
    return mi.load_dict({"type": "scene", "surface": mesh})


def test_edges_of_a_facet_have_no_density() -> None:
    sampler = SurfaceSampler([awkward()])
    normal, along = mi.Normal3f(0, 0, 1), mi.Vector3f([1, 0], [0, 0], [0, 0])
    pdf = sampler.pdf_solid_angle(mi.UInt32(0), mi.UInt32(0), normal, along, mi.Bool(True))
    assert (np.array(pdf) == 0).all()


def test_share_falls_smoothly_from_the_sphere_on() -> None:
    radii = np.linspace(0, 3, 3001)
    found = np.array(share(mi.Float(radii)))
    assert (found[radii <= 1] == 1).all()
    assert (found[radii >= SHELL + 1e-6] == 0).all()
    assert (np.diff(found) <= 0).all()
    assert np.abs(np.diff(found)).max() < 0.01
