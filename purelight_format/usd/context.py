"""What a prim has from those above it: its place, and what its instances may differ in."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

PURPOSES = ("full", "preview", "")  # Of materials, the most detailed first.
INHERITED = ("material:binding", "primvars:", "purpose")


@dataclass(frozen=True)
class Space:
    """Where the transforms of prims lead to: the frame of a prim above them, or the world.

    Arguments:
        time: A `Usd.TimeCode`.
        root: A `Usd.Prim`; the world if None.
    """

    time: Any
    root: Any = field(default=None, hash=False)

    @cached_property
    def _cache(self) -> Any:
        from pxr import UsdGeom

        return UsdGeom.XformCache(self.time)

    def matrix(self, prim: Any) -> NDArray[np.float64]:
        """The prim's own frame in this space: [4, 4] for column vectors."""
        if self.root is None:
            return np.array(self._cache.GetLocalToWorldTransform(prim)).T
        if prim == self.root:
            return np.eye(4)
        return np.array(self._cache.ComputeRelativeTransform(prim, self.root)[0]).T


@dataclass
class Contexts:
    """Tells which instances look the same inside.

    Arguments:
        time: A `Usd.TimeCode`.
    """

    time: Any
    _known: dict[str, tuple[Any, ...]] = field(default_factory=dict)

    def key(self, instance: Any) -> tuple[Any, ...]:
        """Equal for instances of one prototype with the same materials, primvars and purpose.

        Where a collection binds materials, which it does by path, no other has the same key.
        """
        names = instance.GetAuthoredPropertyNames()
        holder = instance if any(n.startswith(INHERITED) for n in names) else instance.GetParent()
        path = str(holder.GetPath())
        if path not in self._known:
            self._known[path] = self._inherited(holder)
        collected, *rest = self._known[path]
        alone = str(instance.GetPath()) if collected else ""
        return (str(instance.GetPrototype().GetPath()), alone, *rest)

    def _inherited(self, prim: Any) -> tuple[Any, ...]:
        """What those below a prim have from it; first whether collections bind materials."""
        from pxr import UsdGeom, UsdShade

        binding, imageable = UsdShade.MaterialBindingAPI(prim), UsdGeom.Imageable(prim)
        bound = (binding.ComputeBoundMaterial(purpose)[0] for purpose in PURPOSES)
        primvars = UsdGeom.PrimvarsAPI(prim).FindInheritablePrimvars()
        return (
            _in_collections(prim),
            tuple(str(material.GetPath()) if material else "" for material in bound),
            tuple(sorted((p.GetPrimvarName(), _value(p, self.time)) for p in primvars)),
            str(imageable.ComputePurpose()) if imageable else "",
        )


def _value(primvar: Any, time: Any) -> str:
    return repr(primvar.ComputeFlattened(time))


def _in_collections(prim: Any) -> bool:
    """Whether a prim, or one above it, binds materials to a collection."""
    while prim:
        if prim.GetPropertiesInNamespace("material:binding:collection"):
            return True
        prim = prim.GetParent()
    return False
