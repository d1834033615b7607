"""Eqs. 1 to 8 in NumPy, torch and a graph, which must all be what NumPy gives in float64."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
import torch

from purelight_export.graph import Graph, Value
from purelight_format import measures
from purelight_format.measures import BoundingSphere
from purelight_onnx.session import Session

Piece = Callable[..., tuple[Any, ...]]
Backend = Callable[..., list[np.ndarray]]

SPHERE = BoundingSphere((1.0, 2.0, -3.0), 0.5)  # Exact in float32, so that its centre can be hit.
R_MAX = 15.0


def in_numpy(dtype: Any, piece: Piece, *inputs: np.ndarray) -> list[np.ndarray]:
    results = piece(*(array.astype(dtype) for array in inputs))
    assert all(result.dtype in (dtype, np.bool_) for result in results)
    return list(results)


def in_torch(dtype: Any, piece: Piece, *inputs: np.ndarray) -> list[np.ndarray]:
    results = piece(*(torch.from_numpy(array).to(dtype) for array in inputs))
    assert all(result.dtype in (dtype, torch.bool) for result in results)
    return [result.numpy() for result in results]


def in_graph(piece: Piece, *inputs: np.ndarray) -> list[np.ndarray]:
    """By ONNX Runtime; a number a row is [N, 1] in a graph."""
    graph = Graph("piece")
    columns = [array.reshape(len(array), -1) for array in inputs]
    for k, value in enumerate(
        piece(*(graph.input(f"x{k}", x.shape[1]) for k, x in enumerate(columns)))
    ):
        graph.output(f"y{k}", _float(graph, value))
    results = Session(graph.to_bytes())({f"x{k}": x for k, x in enumerate(columns)})
    return [result[:, 0] if result.shape[1] == 1 else result for result in results.values()]


def _float(graph: Graph, value: Value) -> Value:
    return graph.cast(value, np.float32) if value.dtype == np.bool_ else value


reference: Backend = partial(in_numpy, np.float64)
BACKENDS: dict[str, tuple[Backend, float]] = {  # And their rounding over that of float32.
    "numpy32": (partial(in_numpy, np.float32), 1.0),
    "torch64": (partial(in_torch, torch.float64), 1e-8),
    "torch32": (partial(in_torch, torch.float32), 1.0),
    "graph": (in_graph, 1.0),
}
backends = pytest.mark.parametrize(("backend", "step"), BACKENDS.values(), ids=BACKENDS)

# Inputs, rounded to float32, the hard ones first


def unit(count: int, seed: int) -> np.ndarray:
    """Unit vectors: the coordinate axes, nearly -Z, and random ones."""
    rng = np.random.default_rng(seed)
    tilts = [(s, -s, -1) for s in (1e-2, 1e-4, 1e-6, 1e-9, 1e-12)]
    hard = np.concatenate((np.eye(3), -np.eye(3), tilts))
    vectors = np.concatenate((hard, rng.standard_normal((count - len(hard), 3))))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def axes() -> np.ndarray:
    return unit(500, 1).astype(np.float32)


def squares(count: int = 2000) -> np.ndarray:
    """Corners, sides, diagonals, the middle, and random points."""
    side = np.array([0, 2**-24, 0.25, 0.5, 0.75, 1 - 2**-24, 1])
    grid = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    random = np.random.default_rng(2).random((count - len(grid), 2))
    return np.concatenate((grid, random)).astype(np.float32)


def points(count: int = 2000) -> np.ndarray:
    """The centre, inside, just outside, and up to where squares would overflow, in every direction.

    The sphere itself is left out: there the last digit decides what is outside.
    """
    radii = [0.0, 1e-3, 0.5, 0.99, 1.001, 1.01, 1.5, 3.0, 14.0, 16.0, 1e3, 1e6, 1e20]
    distance = np.resize(np.repeat(radii, 16), count)[:, None]
    return (SPHERE.center + SPHERE.radius * distance * unit(count, 3)).astype(np.float32)


def toward() -> np.ndarray:
    """Directions for `points`: most in their caps, some along the axis, against it, and beside."""
    view = measures.cap(points().astype(np.float64), SPHERE)
    inner = measures.cap_to_direction(0.02 + 0.96 * squares().astype(np.float64), view)
    beside = 0.96 * measures.frame(view.axis)[0] - 0.28 * view.axis
    kind = np.arange(len(inner))[:, None] % 8
    chosen = np.where(kind == 5, view.axis, np.where(kind == 6, -view.axis, inner))
    return np.where(kind == 7, beside, chosen).astype(np.float32)


# Pieces


def cap_of(point: Any) -> tuple[Any, ...]:
    view = measures.cap(point, SPHERE)
    return view.axis, view.one_minus_cos, view.outside, view.solid_angle


def directions_of(point: Any, u: Any) -> tuple[Any, ...]:
    return (measures.cap_to_direction(u, measures.cap(point, SPHERE)),)


def squares_of(point: Any, toward: Any) -> tuple[Any, ...]:
    return measures.direction_to_cap(toward, measures.cap(point, SPHERE))


def there_and_back(point: Any, u: Any) -> tuple[Any, ...]:
    view = measures.cap(point, SPHERE)
    return measures.direction_to_cap(measures.cap_to_direction(u, view), view)


def angle(point: np.ndarray) -> np.ndarray:
    """About the half-angle of the caps [N, 1], by which errors on the square count."""
    return np.sqrt(measures.cap(point.astype(np.float64), SPHERE).one_minus_cos)[:, None]


def away(point: np.ndarray) -> np.ndarray:
    return np.linalg.norm(point.astype(np.float64) - SPHERE.center, axis=1) / SPHERE.radius


@backends
def test_frames(backend: Backend, step: float) -> None:
    ours, wanted = (np.stack(run(measures.frame, axes())) for run in (backend, reference))
    np.testing.assert_allclose(ours, wanted, atol=5e-7 * step)


@backends
def test_square_and_disk(backend: Backend, step: float) -> None:
    def to_disk(u: Any) -> tuple[Any, ...]:
        return (measures.square_to_disk(u),)

    def to_square(disk: Any) -> tuple[Any, ...]:
        return (measures.disk_to_square(disk),)

    disk = reference(to_disk, squares())[0].astype(np.float32)
    for piece, given in ((to_disk, squares()), (to_square, disk)):
        (ours,), (wanted,) = backend(piece, given), reference(piece, given)
        np.testing.assert_allclose(ours, wanted, atol=5e-7 * step)
    (back,) = backend(lambda u: to_square(*to_disk(u)), squares())
    np.testing.assert_allclose(back, squares(), atol=5e-7 * step)


@backends
def test_caps(backend: Backend, step: float) -> None:
    ours, wanted = backend(cap_of, points()), reference(cap_of, points())
    np.testing.assert_allclose(ours[0], wanted[0], atol=5e-7 * step)
    np.testing.assert_array_equal(ours[2].astype(bool), wanted[2])
    for k in (1, 3):
        np.testing.assert_allclose(ours[k], wanted[k], rtol=1e-5 * step)


@backends
def test_directions(backend: Backend, step: float) -> None:
    given = points(), squares()
    (ours,), (wanted,) = backend(directions_of, *given), reference(directions_of, *given)
    near = away(points()) < 1.005  # A half-angle of nearly 90 degrees is sensitive.
    np.testing.assert_allclose(ours[near], wanted[near], atol=1e-5 * step)
    np.testing.assert_allclose(ours[~near], wanted[~near], atol=2e-6 * step)


@backends
def test_squares_of_directions(backend: Backend, step: float) -> None:
    given = points(), toward()
    (ours, inside), (wanted, truly) = backend(squares_of, *given), reference(squares_of, *given)
    ahead = np.arange(len(ours)) % 8 != 6  # What is opposite to the axis has no place.
    assert (np.abs(ours - wanted) * angle(points()))[ahead].max() < 2e-6 * step
    certain = away(points()) < 500  # Beyond, a float32 direction has few digits within the cap.
    np.testing.assert_array_equal(inside[certain].astype(bool), truly[certain])
    assert 0.7 < truly[certain].mean() < 0.8


@backends
def test_directions_come_back(backend: Backend, step: float) -> None:
    square, inside = backend(there_and_back, points(), squares())
    assert (np.abs(square - squares()) * angle(points())).max() < 1e-6 * step
    well_inside = (np.abs(squares() - 0.5).max(1) < 0.45) & (away(points()) < 500)
    assert inside[well_inside].all()


@backends
def test_encoded_points(backend: Backend, step: float) -> None:
    def encoded(point: Any) -> tuple[Any, ...]:
        return measures.encode_point(point, SPHERE, R_MAX)

    (place, t), wanted = backend(encoded, points()), reference(encoded, points())
    np.testing.assert_allclose(place, wanted[0], atol=3e-7 * step)
    np.testing.assert_allclose(t, wanted[1], atol=5e-6 * step)


@backends
def test_distances(backend: Backend, step: float) -> None:
    def share(point: Any) -> tuple[Any, ...]:
        return (measures.log_distance(point, SPHERE, R_MAX),)

    (found,), (wanted,) = backend(share, points()), reference(share, points())
    np.testing.assert_allclose(np.reshape(found, -1), np.reshape(wanted, -1), atol=1e-6 * step)
    np.testing.assert_allclose([wanted.min(), wanted.max()], [0, 1], atol=1e-12)


@backends
def test_densities_by_area(backend: Backend, step: float) -> None:
    def converted(*args: Any) -> tuple[Any, ...]:
        return (measures.area_to_solid_angle(*args),)

    point, normal, pdf = points(192), unit(192, 6), np.linspace(0.1, 10, 192)
    position = SPHERE.center + SPHERE.radius * unit(192, 5)
    offset = position - point
    facing = np.abs((offset * normal).sum(1)) > 0.05 * np.linalg.norm(offset, axis=1)
    given = [array[facing].astype(np.float32) for array in (pdf, point, position, normal)]
    (ours,), (wanted,) = backend(converted, *given), reference(converted, *given)
    np.testing.assert_allclose(ours, wanted, rtol=1e-5 * step)
