"""The materials of a stage, and what they are bound to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.usd.context import PURPOSES
from purelight_mitsuba.usd_scene.preview_surface import PLAIN, Look, PreviewSurface, rgb
from purelight_mitsuba.usd_scene.shader_inputs import uv_name
from purelight_mitsuba.usd_scene.values import Values, within


@dataclass
class Materials:
    """The materials of a stage, each made once.

    Arguments:
        values: How attributes are read.
        note: Is told of what is rendered otherwise.
    """

    values: Values
    note: Callable[[Any, str], None]
    _made: dict[tuple[str, bool], Look] = field(default_factory=dict)

    def subsets(self, prim: Any) -> Iterator[tuple[Any, np.ndarray]]:
        """The parts of a mesh that are bound to materials of their own: prim, and its faces."""
        from pxr import UsdShade

        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            faces = subset.GetIndicesAttr().Get(self.values.time)
            yield subset.GetPrim(), np.asarray(faces if faces is not None else [], np.int64)

    def uv_name(self, prim: Any) -> str:
        """The primvar that holds the texture coordinates of a prim's material, `st` by default."""
        parts = (prim, *(subset for subset, _ in self.subsets(prim)))
        found = (self._surface(bound)[1] for bound in parts)
        return uv_name((surface for surface in found if surface), self.values)

    def look(self, bound: Any, shape: Any, *, flat: bool = False) -> Look:
        """How the material that is bound to a prim looks.

        Arguments:
            bound: The prim or subset with the binding.
            shape: The shape itself, whose display colour counts where nothing is bound.
            flat: Whether it has no texture coordinates, so that textures are read at one point.
        """
        material, surface = self._surface(bound)
        volume = material.ComputeVolumeSource()[0] if material else None
        if volume:
            self.note(volume.GetPrim(), "a participating medium; rendered without it")
        if not surface:
            if material:
                self.note(material.GetPrim(), "no UsdPreviewSurface; rendered in display colour")
            return self._plain(shape)
        if surface.GetIdAttr().Get() != "UsdPreviewSurface":
            kind = surface.GetIdAttr().Get() or "a shader without an id"
            self.note(surface.GetPrim(), f"{kind} is not supported; rendered in display colour")
            return self._plain(shape)
        key = str(surface.GetPath()), flat
        if key not in self._made:
            read = PreviewSurface(surface, self.values, self.note, flat)
            self._made[key] = read.look()
        return self._made[key]

    def _surface(self, bound: Any) -> tuple[Any, Any]:
        """The material that is bound, and its surface shader; a UsdPreviewSurface if there is one.

        Materials may be bound apart for final and for preview renderings.
        """
        from pxr import UsdShade

        binding = UsdShade.MaterialBindingAPI(bound)
        found = []
        for purpose in PURPOSES:
            material = binding.ComputeBoundMaterial(purpose)[0]
            surface = material.ComputeSurfaceSource()[0] if material else None
            found.append((material, surface))
            if surface and surface.GetIdAttr().Get() == "UsdPreviewSurface":
                return material, surface
        return next((pair for pair in found if pair[0]), (None, None))

    def _plain(self, prim: Any) -> Look:
        """A diffuse surface in the prim's display colour."""
        found = self.values.primvar(prim, "displayColor", 3)
        color = [PLAIN] * 3 if found is None or not len(found[0]) else found[0].mean(0).tolist()
        cut = within(color).tolist()
        if cut != color:
            self.note(prim, "displayColor is not within 0 and 1; cut")
        if found is not None and len(found[0]) > 1:
            self.note(prim, "display colour varies over the prim; rendered in its mean")
        diffuse = {"type": "diffuse", "reflectance": rgb(cut)}
        return Look(mi.load_dict({"type": "twosided", "inner": diffuse}))
