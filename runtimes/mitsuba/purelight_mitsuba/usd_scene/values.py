"""Values of attributes and transforms of prims at one time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from purelight_format.usd.context import Space

NUMBERS = "biuf"  # Kinds of NumPy's types.


@dataclass(frozen=True)
class Values:
    """Reads prims at a time code.

    Arguments:
        time: A `Usd.TimeCode`.
        note: Is told of values of a wrong form.
        space: In which transforms are read; the world if None.
        place: [4, 4] what comes after that, for column vectors; nothing if None.
    """

    time: Any
    note: Callable[[Any, str], None]
    space: Space | None = None
    place: np.ndarray | None = None

    def within(self, space: Space, place: np.ndarray | None = None) -> Values:
        """The values of prims that are read in another space."""
        return replace(self, space=space, place=place)

    def get(self, prim: Any, name: str, default: Any = None) -> Any:
        """An attribute's value, or the default where it has none of the default's form."""
        return self.of(prim.GetAttribute(name), default)

    def of(self, attribute: Any, default: Any) -> Any:
        """The value of an attribute, or the default where it has none of the default's form."""
        value = attribute.Get(self.time) if attribute else None
        if value is None or fits(value, default):
            return default if value is None else value
        self.note(attribute.GetPrim(), f"{attribute.GetName()} is of another type; ignored")
        return default

    def number(self, prim: Any, name: str, default: float) -> float:
        return float(self.get(prim, name, default))

    def to_world(self, prim: Any) -> np.ndarray:
        """The prim's transform as a [4, 4] float64 matrix for column vectors."""
        matrix = (self.space or Space(self.time)).matrix(prim)
        return matrix if self.place is None else self.place @ matrix

    def primvar(self, prim: Any, name: str, width: int) -> tuple[np.ndarray, str] | None:
        """A primvar's values without its index, and its interpolation; None where there is none.

        Arguments:
            width: Of a value; the result's are [N, width].
        """
        from pxr import UsdGeom

        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            return None
        value = np.asarray(primvar.ComputeFlattened(self.time))  # None where an index is outside
        if value.dtype.kind not in NUMBERS or value.shape[value.ndim > 1 :] not in ((width,), (0,)):
            self.note(prim, f"primvar {name} is no list of {width} numbers each; ignored")
            return None
        return value.astype(np.float32).reshape(-1, width), str(primvar.GetInterpolation())


def fits(value: Any, default: Any) -> bool:
    """Whether a value has the form of a default: a number, as many numbers, or a list of any."""
    if default is None or isinstance(default, str):
        return True
    array = np.asarray(value)
    return array.dtype.kind in NUMBERS and (default == [] or array.shape == np.shape(default))


def scales(to_world: np.ndarray) -> np.ndarray:
    """Lengths [3] of the images of the axes."""
    return np.linalg.norm(to_world[:3, :3], axis=0)


def rigid(to_world: np.ndarray) -> np.ndarray:
    """The nearest transform without scale or shear."""
    result = to_world.copy()
    u, _, v = np.linalg.svd(to_world[:3, :3])
    result[:3, :3] = u @ v
    return result


def upright(to_world: np.ndarray) -> np.ndarray:
    """The nearest rotation and place of a shape that is its own mirror image in Y.

    Mitsuba turns such a shape inside out where a transform mirrors it.
    """
    result = rigid(to_world)
    result[:3, 1] *= np.sign(np.linalg.det(result[:3, :3]))
    return result


def within(values: Any, most: float = 1.0) -> np.ndarray:
    """Numbers [...] from 0 to the most there can be; what is no number is 0."""
    infinite = 0.0 if np.isinf(most) else most
    finite = np.nan_to_num(values, nan=0.0, posinf=infinite, neginf=0.0)
    result: np.ndarray = np.clip(finite, 0, most)
    return result
