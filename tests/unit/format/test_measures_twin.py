"""The measures against their twin, on ordinary and hard inputs, and faults that it notices."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from contextlib import suppress
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from purelight_format import measures
from tests.support import measures_twin as twin

SPHERE = twin.Sphere((0.3, -0.2, 1.1), 0.4)
EDGE = [0.0, 2.0**-24, 0.25, 0.5, 0.75, 1 - 2.0**-24, 1.0]
INSIDE = [0.0, 1e-9, 0.5, 0.999]  # Radii.
OUTSIDE = [1.00001, 1.01, 1.5, 3, 15, 1e3, 1e6]
Pair = tuple[np.ndarray, np.ndarray]


def directions(count: int, seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).standard_normal((count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def axes() -> np.ndarray:
    """The six axes, some that nearly point down, and many others."""
    tilt = np.array([1e-3, 1e-5, 1e-7, 2e-10, 1e-11, 1e-30])
    down = np.stack((0.6 * tilt, -0.8 * tilt, -np.sqrt(1 - tilt**2)), 1)
    return np.concatenate((np.eye(3), -np.eye(3), down, directions(300, 1)))


def squares(count: int = 500) -> np.ndarray:
    """Corners, sides, diagonals and the centre, and many others."""
    grid = np.stack(np.meshgrid(EDGE, EDGE), -1).reshape(-1, 2)
    return np.concatenate((grid, np.random.default_rng(2).random((count - len(grid), 2))))


def points(radii: list[float], each: int = 40) -> np.ndarray:
    """Points at these distances, those right above and below the centre first."""
    away = directions(each * len(radii), 3).reshape(-1, each, 3)
    away[:, 0], away[:, 1] = (0, 0, 1), (0, 0, -1)
    return (SPHERE.center + away * (SPHERE.radius * np.array(radii))[:, None, None]).reshape(-1, 3)


def cap(module: Any, point: np.ndarray) -> Any:
    return module.cap(point, module.BoundingSphere(SPHERE.center, SPHERE.radius))


# What a module of measures and its twin say of the same inputs: arrays to be equal


def frames(module: Any) -> Pair:
    return np.stack(module.frame(axes())), np.stack(twin.frame(axes()))


def disks(module: Any) -> Pair:
    return module.square_to_disk(squares()), twin.square_to_disk(squares())


def squares_of_disks(module: Any) -> Pair:
    disk = twin.square_to_disk(squares())
    return module.disk_to_square(disk), twin.disk_to_square(disk)


def cap_axes(module: Any) -> Pair:
    point = points(INSIDE + OUTSIDE)
    return cap(module, point).axis, twin.cap(point, SPHERE).axis


def cap_sizes(module: Any) -> Pair:
    """Over the square of the distance, so that far caps count like near ones."""
    far = np.concatenate((np.eye(3), -np.eye(3))) * [[1e20]] + SPHERE.center
    point = np.concatenate((points(INSIDE + OUTSIDE), far))
    ours, theirs = cap(module, point), twin.cap(point, SPHERE)
    assert (ours.outside == theirs.outside).all()
    assert not ours.outside[: 40 * len(INSIDE)].any()
    known = theirs.one_minus_cos
    return np.stack((ours.one_minus_cos, ours.solid_angle)) / known, np.stack(
        (np.ones_like(known), np.full_like(known, 2 * np.pi))
    )


def just_outside(module: Any) -> Pair:
    """At which side of R (1 + 1e-6) a point is served."""
    point = points([1 + 0.99e-6, 1 + 1.01e-6])
    return cap(module, point).outside, twin.cap(point, SPHERE).outside


def directions_of_caps(module: Any) -> Pair:
    point = points(INSIDE + OUTSIDE)
    u = squares(len(point))
    ours = module.cap_to_direction(u, cap(module, point))
    return ours, twin.cap_to_direction(u, twin.cap(point, SPHERE))


def squares_of_caps(module: Any) -> Pair:
    """Directions in the cap, beside it, and all about."""
    point = points([*INSIDE, *OUTSIDE[:5]])
    view = twin.cap(point, SPHERE)
    toward = twin.cap_to_direction(squares(len(point)) * 0.98 + 0.01, view)
    toward[::4], toward[1::8] = directions(len(toward[::4]), 4), -toward[1::8]
    ours = module.direction_to_cap(toward, cap(module, point))
    return np.column_stack(ours), np.column_stack(twin.direction_to_cap(toward, view))


def behind_caps(module: Any) -> Pair:
    """The very opposite of the axis, where x = y = 0 as well."""
    point = points(INSIDE + OUTSIDE)
    _, inside = module.direction_to_cap(-twin.cap(point, SPHERE).axis, cap(module, point))
    return inside, np.zeros(len(point), bool)


def encodings(module: Any) -> Pair:
    point = points(INSIDE + OUTSIDE)
    sphere = module.BoundingSphere(SPHERE.center, SPHERE.radius)
    place, ours = module.encode_point(point, sphere, 15.0)
    q, theirs = twin.encode_point(point, SPHERE, 15.0)
    return np.column_stack((2 * place - 1, ours)), np.column_stack((q, theirs))


COMPARED: dict[str, Callable[[Any], Pair]] = {
    compare.__name__: compare
    for compare in (
        frames, disks, squares_of_disks, cap_axes, cap_sizes, just_outside, directions_of_caps,
        squares_of_caps, behind_caps, encodings,
    )
}  # fmt: skip
TOLERANCE = {"frames": 2e-10, "squares_of_caps": 1e-8, "cap_sizes": 1e-10}  # At the pole, far away.


def assert_equal(module: Any, name: str) -> None:
    ours, theirs = COMPARED[name](module)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=TOLERANCE.get(name, 1e-12))


@pytest.mark.parametrize("name", COMPARED)
def test_measures_equal_their_twin(name: str) -> None:
    assert_equal(measures, name)


# Faults


SOURCE = ast.parse(inspect.getsource(measures))
ELSEWHERE = {  # What is not compared here.
    "area_to_solid_angle", "flux_estimate", "light_estimate", "Placement", "UNEVEN", "STRAIGHT",
    "draw_from_map", "MAP_SIDE",
}  # fmt: skip


def numbers() -> list[ast.Constant]:
    """The numbers that the reference is written with."""
    parts = [part for part in SOURCE.body if not ELSEWHERE & names(part)]
    found = [node for part in parts for node in ast.walk(part) if isinstance(node, ast.Constant)]
    return [node for node in found if isinstance(node.value, int | float)]


def names(part: ast.stmt) -> set[str]:
    """What a statement defines."""
    targets = [target.id for target in getattr(part, "targets", ())]
    return {*targets, getattr(part, "name", "")}


def spoilt(number: ast.Constant) -> ModuleType:
    """A copy of the reference, one of whose numbers is a hundredth larger."""
    right, module = number.value, ModuleType(measures.__name__)
    number.value = right * 1.01 if right else 0.01  # type: ignore[operator]
    try:
        exec(compile(SOURCE, "<a faulty copy>", "exec"), module.__dict__)
    finally:
        number.value = right
    return module


def notices(module: ModuleType) -> bool:
    """Whether any comparison fails.

    Raises:
        TypeError, IndexError: The number was an index.
    """
    for name in COMPARED:
        try:
            assert_equal(module, name)
        except (AssertionError, RuntimeWarning):
            return True
    return False


def test_a_changed_number_is_noticed() -> None:
    """Any but guards: of divisions by zero, and of borders that may lie a little farther."""
    noticed: dict[bool, list[Any]] = {True: [], False: []}
    for number in numbers():
        with suppress(TypeError, IndexError):
            noticed[notices(spoilt(number))].append(number.value)
    assert len(noticed[True]) > 3 * len(noticed[False])
    assert all(guard in (0, 1, measures.AHEAD) or guard < 1e-15 for guard in noticed[False])
