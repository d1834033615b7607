"""The suite's vectors of pure geometry against the twin of the code that made them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from purelight_conformance.suite import Suite, VectorSet
from tests.support import measures_twin as twin

Arrays = dict[str, np.ndarray]


def _frame(_: twin.Sphere, axis: np.ndarray) -> Arrays:
    return dict(zip(("tangent", "bitangent"), twin.frame(axis), strict=True))


def _cap(sphere: twin.Sphere, point: np.ndarray) -> Arrays:
    view = twin.cap(point, sphere)
    return {"axis": view.axis, "one_minus_cos": view.one_minus_cos, "outside": view.outside}


def _cap_to_direction(sphere: twin.Sphere, point: np.ndarray, u: np.ndarray) -> Arrays:
    view = twin.cap(point, sphere)
    return {"toward": twin.cap_to_direction(u, view), "pdf_solid_angle": view.pdf_solid_angle}


def _direction_to_cap(sphere: twin.Sphere, point: np.ndarray, toward: np.ndarray) -> Arrays:
    square, inside = twin.direction_to_cap(toward, twin.cap(point, sphere))
    return {"u": square, "inside": inside}


TWINS: dict[str, Callable[..., Arrays]] = {
    "frame": _frame,
    "square_to_disk": lambda _, u: {"disk": twin.square_to_disk(u)},
    "disk_to_square": lambda _, disk: {"u": twin.disk_to_square(disk)},
    "cap": _cap,
    "cap_to_direction": _cap_to_direction,
    "direction_to_cap": _direction_to_cap,
    "area_to_solid_angle": lambda _, **patch: {
        "pdf_solid_angle": twin.area_to_solid_angle(**patch)
    },
}


def equal(vectors: VectorSet) -> bool:
    """Whether the twin says the same, within a hundredth of what a host may be off by."""
    given = vectors.parameters.get("bounding_sphere", {"center": (0, 0, 0), "radius": 1})
    inputs = {name: array.astype(np.float64) for name, array in vectors.inputs.items()}
    answer = TWINS[vectors.operation](twin.Sphere(**given), **inputs)
    return all(
        (np.abs(answer[name] - wanted) <= 0.01 * vectors.tolerances[name]).all()
        for name, wanted in vectors.outputs.items()
    )


@pytest.mark.parametrize("operation", TWINS)
def test_vectors_are_those_of_the_twin(operation: str, whole: Suite) -> None:
    sets = [v for v in whole.sets if v.operation == operation]
    assert sets
    assert all(map(equal, sets))


@pytest.mark.parametrize("operation", TWINS)
def test_wrong_vectors_are_not(operation: str, whole: Suite) -> None:
    first = next(v for v in whole.sets if v.operation == operation)
    for name, tolerance in first.tolerances.items():
        wrong = first.outputs | {name: first.outputs[name] + 0.02 * tolerance}
        assert not equal(replace(first, outputs=wrong))
