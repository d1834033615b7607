"""Arrays in a bundle: .npy bytes, the exit surface, golden vectors."""

from __future__ import annotations

import io

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError
from purelight_format.measures import BoundingSphere
from purelight_format.members import npy
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import SIGNATURES, Vectors, compare, layout
from tests.support import lamp

ARRAYS = [
    np.zeros((0, 3), "<f4"),
    np.arange(12, dtype="<u4").reshape(4, 3),
    np.float64(np.random.default_rng(0).random(7)),
    np.ones((2, 16, 16, 3)),
    np.array(0.5),  # No axis at all: a fuzzer found it written as one of a single element.
]


@pytest.mark.parametrize("array", ARRAYS, ids=lambda a: str(a.shape))
def test_arrays_are_those_of_numpy(array: np.ndarray) -> None:
    file = io.BytesIO()
    np.save(file, array)
    assert npy.dumps(array) == file.getvalue()
    np.testing.assert_array_equal(npy.loads(file.getvalue(), "test", array.dtype.str), array)


def test_other_orders_are_written_in_the_one_order() -> None:
    array = np.arange(6.0).reshape(2, 3)
    for same in (np.asfortranarray(array), array.astype(">f8")):
        assert npy.dumps(same) == npy.dumps(array)


def test_read_arrays_cannot_be_changed() -> None:
    array = npy.loads(npy.dumps(np.ones(3)), "test", "<f8")
    with pytest.raises(ValueError):
        array[0] = 2


def test_every_truncation_of_an_array_is_refused() -> None:
    data = npy.dumps(np.ones(3))
    for size in range(len(data)):
        with pytest.raises(FormatError, match="PLX_NPY_"):
            npy.loads(data[:size], "test", "<f8")


def test_a_surface_comes_back() -> None:
    surface = lamp.surface()
    again = Surface.from_members(surface.to_members().__getitem__)
    for name in ("positions", "triangles", "triangle_flux"):
        np.testing.assert_array_equal(getattr(again, name), getattr(surface, name))


def test_the_area_of_an_octahedron() -> None:
    edge = 0.99 * lamp.SPHERE.radius * np.sqrt(2)
    assert lamp.surface().area().sum() == pytest.approx(2 * np.sqrt(3) * edge**2, rel=1e-6)


def test_zero_area_and_duplicated_triangles_are_allowed() -> None:
    triangles = np.array([[0, 1, 2], [0, 1, 2], [0, 0, 1]], np.uint32)
    flux = np.ones((3, 3), np.float32)
    surface = Surface(lamp.surface().positions, triangles, flux)
    again = Surface.from_members(surface.to_members().__getitem__)
    assert again.area()[2] == 0
    assert not list(again.issues(lamp.SPHERE, (3.0, 3.0, 3.0)))


@pytest.mark.parametrize("radius", [1e-5, 1.0, 1e5])
def test_the_sphere_is_compared_in_radii(radius: float) -> None:
    corners = np.float32(np.eye(3) * radius)
    triangles, flux = np.array([[0, 1, 2]], np.uint32), np.zeros((1, 3), np.float32)
    surface = Surface(corners, triangles, flux)
    close, tight = (BoundingSphere((0.0, 0.0, 0.0), radius * k) for k in (1.0, 0.999))
    assert not list(surface.issues(close, (0.0,) * 3))
    assert [i.code.name for i in surface.issues(tight, (0.0,) * 3)] == [
        "PLX_SURFACE_OUTSIDE_SPHERE"
    ]


@pytest.mark.parametrize("network", lamp.NETWORKS)
def test_vectors_come_back(network: str) -> None:
    vectors = lamp.golden(network, lamp.NETWORKS[network]().SerializeToString())
    members = vectors.to_members()
    assert set(members) == set(layout(network))
    again = Vectors.from_members(network, members.__getitem__)
    for group in ("inputs", "outputs", "tolerances"):
        written, read = getattr(vectors, group), getattr(again, group)
        assert list(written) == list(read)
        for name in read:
            np.testing.assert_array_equal(read[name], written[name])


def appearance(values: list[float]) -> Vectors:
    y = np.array(values)[:, None] * np.ones(3)
    inputs = {name: np.zeros((len(y), 3), np.float32) for name in SIGNATURES["appearance"].inputs}
    return Vectors("appearance", inputs, {"radiance": y}, {"radiance": 1e-3 * (y + 1)})


def test_a_vector_passes_within_its_own_tolerance() -> None:
    vectors = appearance([0.0, 1.0, 1e6])
    off = np.array([9e-4, 1.9e-3, 1.1e3])[:, None] * [0, 0, 1]
    result = compare(vectors, {"radiance": vectors.outputs["radiance"] + off})
    np.testing.assert_array_equal(result.passed, [True, True, False])
    assert result.error["radiance"] == pytest.approx(np.log1p(1.1e-3), rel=1e-2)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_fails(wrong: float) -> None:
    vectors = appearance([1.0, 2.0])
    result = vectors.outputs["radiance"].copy()
    result[1, 0] = wrong
    compared = compare(vectors, {"radiance": result})
    np.testing.assert_array_equal(compared.passed, [True, False])
    assert compared.error["radiance"] == np.inf


def test_densities_are_compared_relative_to_themselves() -> None:
    point, toward = np.zeros((2, 3), np.float32), np.ones((2, 3), np.float32)
    pdf, tolerance = np.array([0.0, 1e6]), np.array([0.0, 1.0])
    vectors = Vectors(
        "sampler_pdf", {"point": point, "toward": toward},
        {"pdf_solid_angle": pdf}, {"pdf_solid_angle": tolerance},
    )  # fmt: skip
    compared = compare(vectors, {"pdf_solid_angle": np.array([0.0, 1e6 + 2])})
    np.testing.assert_array_equal(compared.passed, [True, False])
    assert compared.error["pdf_solid_angle"] == pytest.approx(2e-6)


@pytest.mark.parametrize("result", [{}, {"radiance": np.zeros((2, 1))}, {"radiance": np.zeros(6)}])
def test_results_of_another_shape_are_refused(result: dict[str, np.ndarray]) -> None:
    with pytest.raises(PureLightError, match="radiance"):
        compare(appearance([1.0, 2.0]), result)
