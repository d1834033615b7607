"""Values of attributes and transforms of prims at one time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Values:
    """Reads prims at a time code.

    Arguments:
        time: A `Usd.TimeCode`.
    """

    time: Any

    def get(self, prim: Any, name: str, default: Any = None) -> Any:
        """An attribute's value, or the default where it has none."""
        attribute = prim.GetAttribute(name)
        value = attribute.Get(self.time) if attribute else None
        return default if value is None else value

    def number(self, prim: Any, name: str, default: float) -> float:
        return float(self.get(prim, name, default))

    def to_world(self, prim: Any) -> np.ndarray:
        """The prim's transform as a [4, 4] float64 matrix for column vectors."""
        from pxr import UsdGeom

        return np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(self.time)).T

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
