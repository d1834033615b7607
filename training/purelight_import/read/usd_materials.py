"""Materials of USD stages in plain words: UsdPreviewSurface, Standard Surface, OpenPBR."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.color import LUMENS_PER_WATT
from purelight_import.model.material import (
    BLACK,
    RGB,
    WHITE,
    Color,
    Material,
    Value,
    absorption,
)
from purelight_import.model.notes import Notes
from purelight_import.model.picture import Picture
from purelight_import.read.usd_textures import Textures
from purelight_mitsuba.usd_scene.shader_inputs import CHANNELS, uv_name, value
from purelight_mitsuba.usd_scene.values import Values

PLAIN = 0.18
# What the shaders call the words of `Material`
PREVIEW = {"base": "diffuseColor", "metal": "metallic", "rough": "roughness", "ior": "ior",
           "coat": "clearcoat", "coat_rough": "clearcoatRoughness",
           "emission": "emissiveColor"}  # fmt: skip
STANDARD = {"base": "base_color", "metal": "metalness", "rough": "specular_roughness",
            "ior": "specular_IOR", "coat": "coat", "coat_rough": "coat_roughness",
            "emission": "emission_color", "strength": "emission", "through": "transmission",
            "tint": "transmission_color", "depth": "transmission_depth", "cover": "opacity",
            "thin": "thin_walled", "weight": "base"}  # fmt: skip
OPEN_PBR = {"base": "base_color", "metal": "base_metalness", "rough": "specular_roughness",
            "ior": "specular_ior", "coat": "coat_weight", "coat_rough": "coat_roughness",
            "emission": "emission_color", "strength": "emission_luminance",
            "through": "transmission_weight", "tint": "transmission_color",
            "depth": "transmission_depth", "cover": "geometry_opacity",
            "thin": "geometry_thin_walled", "weight": "base_weight"}  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """A material and its emission in W/(m² sr)."""

    material: Material
    radiance: Color | None = None


@dataclass
class Materials:
    """The materials of a stage, each made once."""

    values: Values
    notes: Notes
    path: Path
    made: dict[str, Surface] = field(default_factory=dict)
    textures: Textures = field(init=False)

    def __post_init__(self) -> None:
        self.textures = Textures(self.values, self.notes, self.path)

    def subsets(self, prim: Any) -> Iterator[tuple[Any, np.ndarray]]:
        """The parts of a mesh with materials of their own: prim, and its faces."""
        from pxr import UsdShade

        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            faces = subset.GetIndicesAttr().Get(self.values.time)
            yield subset.GetPrim(), np.asarray(faces if faces is not None else [], np.int64)

    def uv_name(self, prim: Any) -> str:
        """The primvar that holds the texture coordinates of a prim's material, `st` by default."""
        parts = (prim, *(subset for subset, _ in self.subsets(prim)))
        found = (_bound(bound)[1] for bound in parts)
        return uv_name((shader for shader in found if shader), self.values)

    def surface(self, bound: Any, shape: Any) -> Surface:
        """What is bound to a prim, or a matt surface of its display colour."""
        material, shader = _bound(bound)
        name = material.GetPrim().GetName() if material else ""
        if not shader:
            if material:
                self.notes("materials that are no UsdPreviewSurface are matt", name)
            return Surface(self._plain(name, shape))
        key = str(shader.GetPath())
        if key not in self.made:
            self.made[key] = self._read(name, shader, _words(shader) or PREVIEW)
        return self.made[key]

    def _plain(self, name: str, prim: Any) -> Material:
        found = self.values.primvar(prim, "displayColor", 3)
        r, g, b = [PLAIN] * 3 if found is None or not len(found[0]) else found[0].mean(0).tolist()
        return Material(name, (r, g, b), 0.0, 1.0, specular=0.0)

    def _read(self, name: str, shader: Any, words: dict[str, str]) -> Surface:
        read = _Shader(self, name, shader, words)
        preview = words is PREVIEW
        base = read.color("base", (PLAIN,) * 3 if preview else (0.8,) * 3)
        base = _times(base, 1.0 if preview else float(np.clip(read.number("weight", 1.0), 0, 1)))
        if preview and int(read.number("useSpecularWorkflow", 0)):
            self.notes("specular workflow is taken by its diffuse colour", name)
        material = Material(
            name, base, 0.0 if preview and read.number("useSpecularWorkflow", 0) else
            read.value("metal", 0.0), read.value("rough", 0.5 if preview else 0.2),
            ior=max(read.number("ior", 1.5), 1.0), coat=read.value("coat", 0.0),
            coat_roughness=read.number("coat_rough", 0.01), normal=read.normal(),
        )  # fmt: skip
        material = _preview_glass(material, read) if preview else _glass(material, read)
        emission = read.color("emission", BLACK if preview else WHITE)
        strength = 1.0 if preview else read.number("strength", 0.0)
        if words is OPEN_PBR:
            strength /= LUMENS_PER_WATT  # which states cd/m²
        dark = strength <= 0 or (not isinstance(emission, Picture) and max(emission) <= 0)
        return Surface(material, None if dark else _times(emission, strength))


def _bound(prim: Any) -> tuple[Any, Any]:
    """The material that is bound to a prim, and its shader if that is of a kind that is known."""
    from pxr import UsdShade

    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    for context in ("", "mtlx") if material else ():
        shader = material.ComputeSurfaceSource(context)[0]
        if shader and _words(shader) is not None:
            return material, shader
    return material, None


def _words(shader: Any) -> dict[str, str] | None:
    """How a shader calls things, None if it is of no kind that is known."""
    identifier = str(shader.GetIdAttr().Get() or "")
    if identifier == "UsdPreviewSurface":
        return PREVIEW
    if "standard_surface" in identifier:
        return STANDARD
    return OPEN_PBR if "open_pbr" in identifier else None


def _preview_glass(material: Material, read: _Shader) -> Material:
    """Opacity below one is glass, unless it says that the surface is not there (opacityMode)."""
    opacity: Value = read.value("opacity", 1.0)
    threshold = read.number("opacityThreshold", 0.0)
    cut = threshold > 0 or str(read.plain("opacityMode", "transparent")) == "presence"
    if isinstance(opacity, Picture) or cut:
        if isinstance(opacity, Picture) and threshold > 0:
            whole = np.uint8(255) * (opacity.linear >= threshold).astype(np.uint8)
            opacity = replace(opacity, pixels=whole)
        return replace(material, opacity=opacity)
    if opacity >= 1:
        return material
    through = 1.0 if opacity <= 0.5 else 1 - opacity
    base = material.base_color
    if not isinstance(base, Picture):
        brightest = max(base)
        r, g, b = base
        base = WHITE if brightest < 0.2 else (r / brightest, g / brightest, b / brightest)
    return replace(material, transmission=through, metalness=0.0, base_color=base)


def _glass(material: Material, read: _Shader) -> Material:
    """Transmission; its colour is reached at a depth, or by each surface where that is 0."""
    material = replace(material, opacity=read.cover())
    through = read.value("through", 0.0)
    if not isinstance(through, Picture) and through <= 0:
        return material
    tint, depth = read.color("tint", WHITE), read.number("depth", 0.0)
    thin = bool(read.number("thin", 0))
    absorbs = depth > 0 and not thin and not isinstance(tint, Picture)
    return replace(
        material, transmission=through, thin_walled=thin, base_color=WHITE if absorbs else tint,
        attenuation=absorption(tint, depth) if absorbs else None,
    )  # fmt: skip


def _times(color: Color, factor: float) -> Color:
    if isinstance(color, Picture):
        return color.times(factor)
    return color[0] * factor, color[1] * factor, color[2] * factor


class _Shader:
    """The inputs of one shader."""

    def __init__(self, materials: Materials, name: str, shader: Any, words: dict[str, str]) -> None:
        self.all, self.name, self.shader, self.words = materials, name, shader, words

    def plain(self, key: str, default: Any) -> Any:
        """An input's value, followed through the material's interface, not through textures."""
        return value(self.shader, self.words.get(key, key), default, self.all.values)

    def number(self, key: str, default: float) -> float:
        found = self.plain(key, default)
        if not isinstance(found, (bool, int, float)) or not np.isfinite(found):
            return default
        return float(found)

    def value(self, key: str, default: float) -> Value:
        """A number, or one channel of a texture."""
        found = self._texture(key, srgb=False)
        if found is not None:
            picture, output = found
            names = CHANNELS[picture.pixels.shape[2]]
            if output == "a" and "a" not in names:
                return 1.0
            return picture.channels(max(names.find(output), 0))
        return self.number(key, default)

    def cover(self) -> Value:
        """Opacity, which Standard Surface has as a colour."""
        found = self.plain("cover", None)
        if found is not None and np.shape(found) == (3,):
            return float(np.clip(np.mean(found), 0, 1))
        return self.value("cover", 1.0)

    def color(self, key: str, default: RGB) -> Color:
        """A colour, or a texture."""
        found = self._texture(key, srgb=True)
        if found is not None:
            return found[0].colors()
        r, g, b = (float(v) for v in self.plain(key, default))
        return max(r, 0.0), max(g, 0.0), max(b, 0.0)

    def normal(self) -> Picture | None:
        found = self._texture("normal", srgb=False)
        return None if found is None else found[0].colors()

    def _texture(self, key: str, *, srgb: bool) -> tuple[Picture, str] | None:
        """The texture that feeds an input, and which of its outputs."""
        from pxr import UsdShade

        source = self.shader.GetInput(self.words.get(key, key))
        attributes = source.GetValueProducingAttributes() if source else []
        producer = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if not producer or producer.GetPath() == self.shader.GetPath():
            return None
        if producer.GetIdAttr().Get() != "UsdUVTexture":
            if producer.GetIdAttr().Get():
                self.all.notes("networks of shading nodes are left out", self.name)
            return None
        picture = self.all.textures.picture(producer, self.name, srgb=srgb)
        return None if picture is None else (picture, attributes[0].GetBaseName())
