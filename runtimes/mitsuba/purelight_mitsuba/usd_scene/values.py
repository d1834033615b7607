"""Values of attributes and transforms of prims at one time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.usd.context import Space


@dataclass(frozen=True)
class Values:
    """Reads prims at a time code.

    Arguments:
        time: A `Usd.TimeCode`.
        space: In which transforms are read; the world if None.
        place: [4, 4] what comes after that, for column vectors; nothing if None.
    """

    time: Any
    space: Space | None = None
    place: np.ndarray | None = None

    def within(self, space: Space, place: np.ndarray | None = None) -> Values:
        """The values of prims that are read in another space."""
        return Values(self.time, space, place)

    def get(self, prim: Any, name: str, default: Any = None) -> Any:
        """An attribute's value, or the default where it has none."""
        attribute = prim.GetAttribute(name)
        value = attribute.Get(self.time) if attribute else None
        return default if value is None else value

    def number(self, prim: Any, name: str, default: float) -> float:
        return float(self.get(prim, name, default))

    def to_world(self, prim: Any) -> np.ndarray:
        """The prim's transform as a [4, 4] float64 matrix for column vectors."""
        matrix = (self.space or Space(self.time)).matrix(prim)
        return matrix if self.place is None else self.place @ matrix

    def primvar(self, prim: Any, name: str) -> tuple[np.ndarray, str] | None:
        """A primvar's values without its index, and its interpolation; None where there is none."""
        from pxr import UsdGeom

        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        if not primvar or not primvar.HasValue():
            return None
        value = np.asarray(primvar.ComputeFlattened(self.time), np.float32)
        return value, str(primvar.GetInterpolation())


def scales(to_world: np.ndarray) -> np.ndarray:
    """Lengths [3] of the images of the axes."""
    return np.linalg.norm(to_world[:3, :3], axis=0)


def rigid(to_world: np.ndarray) -> np.ndarray:
    """The nearest transform without scale or shear."""
    result = to_world.copy()
    u, _, v = np.linalg.svd(to_world[:3, :3])
    result[:3, :3] = u @ v
    return result


def within(values: Any, most: float = 1.0) -> np.ndarray:
    """Numbers [...] from 0 to the most there can be; what is no number is 0."""
    infinite = 0.0 if np.isinf(most) else most
    finite = np.nan_to_num(values, nan=0.0, posinf=infinite, neginf=0.0)
    result: np.ndarray = np.clip(finite, 0, most)
    return result
