"""UsdPreviewSurface as Mitsuba's `principled`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.usd.context import PURPOSES
from purelight_mitsuba.usd_scene.shader_inputs import connected, uv_name, value
from purelight_mitsuba.usd_scene.textures import Textures
from purelight_mitsuba.usd_scene.values import Values

PLAIN = 0.18  # Diffuse grey of a UsdPreviewSurface, and of prims without a material.
IGNORED = ("displacement", "occlusion")
DARK = [0.0] * 3


@dataclass(frozen=True)
class Look:
    """How a surface looks.

    Arguments:
        bsdf: Its material.
        mirrored: The same for triangles on which the picture is a mirror image; None if it does
            not matter.
        radiance: That it emits, as Mitsuba's dictionary, or None.
    """

    bsdf: mi.BSDF
    mirrored: mi.BSDF | None = None
    radiance: dict[str, Any] | None = None

    def emitter(self) -> mi.Emitter | None:
        """A light for one shape more."""
        if self.radiance is None:
            return None
        return mi.load_dict({"type": "area", "radiance": self.radiance})


@dataclass
class Materials:
    """The materials of a stage, each made once.

    Arguments:
        values: How attributes are read.
        note: Is told of what is rendered otherwise.
    """

    values: Values
    note: Callable[[Any, str], None]
    _made: dict[str, Look] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._textures = Textures(self.values, self.note)

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

    def look(self, bound: Any, shape: Any) -> Look:
        """How the material that is bound to a prim looks.

        Arguments:
            bound: The prim or subset with the binding.
            shape: The shape itself, whose display colour counts where nothing is bound.
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
        key = str(surface.GetPath())
        if key not in self._made:
            self._made[key] = self._preview_surface(surface)
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
        found = self.values.primvar(prim, "displayColor")
        color = [PLAIN] * 3 if found is None or not len(found[0]) else found[0].mean(0).tolist()
        if found is not None and len(found[0]) > 1:
            self.note(prim, "display colour varies over the prim; rendered in its mean")
        diffuse = {"type": "diffuse", "reflectance": _rgb(color)}
        return Look(mi.load_dict({"type": "twosided", "inner": diffuse}))

    def _preview_surface(self, shader: Any) -> Look:
        for name in IGNORED:
            if shader.GetInput(name) and shader.GetInput(name).HasConnectedSource():
                self.note(shader.GetPrim(), f"{name} map is not supported and was ignored")
        inner, opacity = self._principled(shader), self._input(shader, "opacity", 1.0)
        emissive = self._input(shader, "emissiveColor", DARK)
        radiance = None if emissive == _rgb(DARK) else emissive
        plain, mirrored = (self._normal_map(shader, inner, mirrored=m) for m in (False, True))
        if plain is None:
            return Look(_covered(inner, opacity), None, radiance)
        return Look(_covered(plain, opacity), _covered(mirrored, opacity), radiance)

    def _principled(self, shader: Any) -> dict[str, Any]:
        specular = bool(self._value(shader, "useSpecularWorkflow", 0))
        if specular:
            self.note(shader.GetPrim(), "specular workflow rendered by its diffuse colour")
        roughness = self._input(shader, "roughness", 0.5)
        return {
            "type": "principled",
            "base_color": self._input(shader, "diffuseColor", [PLAIN] * 3),
            "metallic": 0.0 if specular else self._input(shader, "metallic", 0.0),
            "roughness": max(roughness, 0.02) if isinstance(roughness, float) else roughness,
            "eta": max(float(self._value(shader, "ior", 1.5)), 1.001),
            "clearcoat": self._input(shader, "clearcoat", 0.0),
            "clearcoat_gloss": 1 - float(self._value(shader, "clearcoatRoughness", 0.01)),
        }

    def _normal_map(
        self, shader: Any, inner: dict[str, Any], *, mirrored: bool
    ) -> dict[str, Any] | None:
        """The surface under its normal map; None where it has none."""
        source = connected(shader, "normal")
        texture = self._textures.normal(source[0], mirrored=mirrored) if source else None
        return texture and {"type": "normalmap", "normalmap": texture, "bsdf": inner}

    def _value(self, shader: Any, name: str, default: Any) -> Any:
        return value(shader, name, default, self.values)

    def _input(self, shader: Any, name: str, default: Any) -> Any:
        """An input as a number, a colour, or the texture that is connected to it."""
        source, number = connected(shader, name), isinstance(default, float)
        if source is not None:
            read = self._textures
            texture = read.number(*source) if number else read.color(source[0])
            return texture or (default if number else _rgb(default))
        found = self._value(shader, name, default)
        return float(found) if number else _rgb(list(map(float, found)))


def _covered(inner: dict[str, Any] | None, opacity: Any) -> mi.BSDF:
    """Both sides of a surface, as far as it is opaque."""
    bsdf: dict[str, Any] = {"type": "twosided", "inner": inner}
    if opacity != 1.0:
        bsdf = {"type": "mask", "opacity": opacity, "inner": bsdf}
    return mi.load_dict(bsdf)


def _rgb(value: list[float]) -> dict[str, Any]:
    return {"type": "rgb", "value": value}
