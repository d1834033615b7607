"""What the lamps' shapes are made by: colours of light, lenses, pierced sheets, poses."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_examples.luminaires import optics, poses
from purelight_examples.luminaires.light import black_body, radiance
from purelight_examples.luminaires.pierced import on_prism, pierced, quatrefoil
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE

INDEX = 1.49


def test_black_bodies_have_the_colours_of_tables() -> None:
    """Mitchell Charity's table of black bodies (2 degrees), as linear Rec.709 over red."""
    for kelvin, green, blue in ((2800, 0.44, 0.11), (4000, 0.66, 0.38), (6500, 0.95, 0.99)):
        color = np.array(black_body(kelvin))
        assert LUMINANCE @ color == pytest.approx(1)
        np.testing.assert_allclose(color[1:] / color[0], (green, blue), atol=0.03)
    assert black_body(1500)[2] == 0


def test_radiance_gives_the_lumens() -> None:
    watts = np.pi * 0.02 * np.array(radiance(800, 3000, 0.02))
    assert LUMENS_PER_WATT * (LUMINANCE @ watts) == pytest.approx(800)


def refracted(ray: np.ndarray, normal: np.ndarray, ratio: float) -> np.ndarray:
    """Snell's law in the plane; `ratio` of the indices, before over behind."""
    cosine = -ray @ normal
    root = 1 - ratio**2 * (1 - cosine**2)
    return ratio * ray + (ratio * cosine - np.sqrt(root)) * normal


def normals(path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of a path's pieces, and their unit normals to the left."""
    along = np.diff(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return 0.5 * (path[1:] + path[:-1]), np.stack((-along[:, 1], along[:, 0]), 1)


def test_the_front_of_a_collimator_makes_light_parallel() -> None:
    middles, left = normals(optics.collimating_front(INDEX, 0.009, 0.007, steps=40))
    for at, normal in zip(middles, left, strict=True):
        ray = refracted(at / np.linalg.norm(at), -normal, 1 / INDEX)
        assert ray[0] == pytest.approx(0, abs=0.01)


def test_the_side_of_a_collimator_reflects_all_light_forwards() -> None:
    wall, last = 0.007, 0.5
    middles, left = normals(optics.reflecting_side(INDEX, wall, 0.0085, last, steps=200))
    found = []
    for at, normal in zip(middles, left, strict=True):
        heights = np.linspace(0, wall / np.tan(last), 20_000)
        inside = np.stack((np.full_like(heights, wall), heights), 1)
        sine = heights / np.hypot(wall, heights) / INDEX  # of the elevation within the lens
        reach = at[0] - wall
        miss = np.abs(heights + reach * sine / np.sqrt(1 - sine**2) - at[1])
        ray = at - inside[np.argmin(miss)]
        ray /= np.linalg.norm(ray)
        outward = -normal if normal[0] < 0 else normal
        assert ray @ outward > 0
        assert np.sqrt(1 - (ray @ outward) ** 2) > 1 / INDEX  # totally
        found.append(ray - 2 * (ray @ outward) * outward)
    np.testing.assert_allclose(np.array(found), np.tile((0, 1), (len(found), 1)), atol=0.02)


def test_a_pierced_sheet_has_as_many_holes_as_it_says() -> None:
    mesh = pierced(12, 3, quatrefoil(0.8), on_prism(6, 0.1, 0.09, -0.05, 0.05), per_side=5)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert mesh.body_count == 1
    assert mesh.euler_number == 2 - 2 * (1 + 12 * 3)  # a ring, with as many handles


def test_more_open_sheets_have_less_metal() -> None:
    place = on_prism(6, 0.1, 0.09, -0.05, 0.05)
    solid, open_ = (pierced(12, 3, quatrefoil(size), place, 6).volume for size in (0.3, 0.9))
    whole = 3 * np.sin(np.pi / 3) * (0.1**2 - 0.09**2) * 0.1
    assert open_ < 0.6 * whole < 0.9 * whole < solid < whole


def test_copies_stand_around_the_axis_and_look_outwards() -> None:
    found = poses.around(4, 2.0, 1.0, start=0.5)
    np.testing.assert_allclose(found[0][:3, 3], (2**0.5, 2**0.5, 1))
    for pose in found:
        outwards = pose[:3, 3] * (1, 1, 0)
        np.testing.assert_allclose(pose[:3, 0], outwards / 2, atol=1e-12)
