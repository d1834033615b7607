"""UsdPreviewSurface as Mitsuba's `principled`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_mitsuba.usd_scene.values import Values

CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}
PLAIN = 0.18  # Diffuse grey of a UsdPreviewSurface, and of prims without a material.
IGNORED = ("displacement", "normal", "occlusion")


@dataclass
class Materials:
    """The materials of a stage, each made once.

    Arguments:
        values: How attributes are read.
        note: Is told of what is rendered otherwise.
    """

    values: Values
    note: Callable[[Any, str], None]
    _made: dict[str, tuple[mi.BSDF, mi.Emitter | None]] = field(default_factory=dict)

    def subsets(self, prim: Any) -> Iterator[tuple[Any, np.ndarray]]:
        """The parts of a mesh that are bound to materials of their own: prim, and its faces."""
        from pxr import UsdShade

        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            faces = subset.GetIndicesAttr().Get(self.values.time)
            yield subset.GetPrim(), np.asarray(faces if faces is not None else [], np.int64)

    def bsdf(self, bound: Any, shape: Any) -> tuple[mi.BSDF, mi.Emitter | None]:
        """The BSDF of the material that is bound to a prim, and its emission if it has one.

        Arguments:
            bound: The prim or subset with the binding.
            shape: The shape itself, whose display colour counts where nothing is bound.
        """
        from pxr import UsdShade

        material, _ = UsdShade.MaterialBindingAPI(bound).ComputeBoundMaterial()
        surface = material.ComputeSurfaceSource()[0] if material else None
        volume = material.ComputeVolumeSource()[0] if material else None
        if volume:
            self.note(volume.GetPrim(), "a participating medium; rendered without it")
        if not surface:
            if material:
                self.note(material.GetPrim(), "no UsdPreviewSurface; rendered in display colour")
            return self._plain(shape), None
        if surface.GetIdAttr().Get() != "UsdPreviewSurface":
            kind = surface.GetIdAttr().Get() or "a shader without an id"
            self.note(surface.GetPrim(), f"{kind} is not supported; rendered in display colour")
            return self._plain(shape), None
        key = str(surface.GetPath())
        if key not in self._made:
            self._made[key] = self._preview_surface(surface)
        return self._made[key]

    def _plain(self, prim: Any) -> mi.BSDF:
        """A diffuse surface in the prim's display colour."""
        found = self.values.primvar(prim, "displayColor")
        color = [PLAIN] * 3 if found is None or not len(found[0]) else found[0].mean(0).tolist()
        if found is not None and len(found[0]) > 1:
            self.note(prim, "display colour varies over the prim; rendered in its mean")
        diffuse = {"type": "diffuse", "reflectance": _rgb(color)}
        return mi.load_dict({"type": "twosided", "inner": diffuse})

    def _preview_surface(self, shader: Any) -> tuple[mi.BSDF, mi.Emitter | None]:
        for name in IGNORED:
            if shader.GetInput(name) and shader.GetInput(name).HasConnectedSource():
                self.note(shader.GetPrim(), f"{name} map is not supported and was ignored")
        specular = bool(self._value(shader, "useSpecularWorkflow", 0))
        if specular:
            self.note(shader.GetPrim(), "specular workflow rendered by its diffuse colour")
        roughness = self._input(shader, "roughness", 0.5)
        inner = {
            "type": "principled",
            "base_color": self._input(shader, "diffuseColor", [PLAIN] * 3),
            "metallic": 0.0 if specular else self._input(shader, "metallic", 0.0),
            "roughness": max(roughness, 0.02) if isinstance(roughness, float) else roughness,
            "eta": max(float(self._value(shader, "ior", 1.5)), 1.001),
            "clearcoat": self._input(shader, "clearcoat", 0.0),
            "clearcoat_gloss": 1 - float(self._value(shader, "clearcoatRoughness", 0.01)),
        }
        opacity = self._input(shader, "opacity", 1.0)
        bsdf: dict[str, Any] = {"type": "twosided", "inner": inner}
        if opacity != 1.0:
            bsdf = {"type": "mask", "opacity": opacity, "inner": bsdf}
        emissive = self._input(shader, "emissiveColor", [0.0] * 3)
        dark = emissive == _rgb([0.0] * 3)
        emission = None if dark else mi.load_dict({"type": "area", "radiance": emissive})
        return mi.load_dict(bsdf), emission

    def _value(self, shader: Any, name: str, default: Any) -> Any:
        """An input's value, followed through the material's interface but not through textures."""
        source = shader.GetInput(name)
        if not source:
            return default
        attributes = source.GetValueProducingAttributes()
        value = attributes[0].Get(self.values.time) if attributes else None
        return default if value is None else value

    def _input(self, shader: Any, name: str, default: Any) -> Any:
        """An input as a number, a colour, or the texture that is connected to it."""
        from pxr import UsdShade

        source = shader.GetInput(name)
        attributes = source.GetValueProducingAttributes() if source else []
        producer = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
        if producer and producer.GetPath() != shader.GetPath() and producer.GetIdAttr().Get():
            return self._texture(producer, attributes[0].GetBaseName(), default)
        value = self._value(shader, name, default)
        return float(value) if isinstance(default, float) else _rgb(list(map(float, value)))

    def _texture(self, reader: Any, output: str, default: Any) -> Any:
        """A `UsdUVTexture` as a bitmap; one channel of it for a number."""
        fallback = default if isinstance(default, float) else _rgb(default)
        if reader.GetIdAttr().Get() != "UsdUVTexture":
            self.note(reader.GetPrim(), f"{reader.GetIdAttr().Get()} is not supported; ignored")
            return fallback
        asset = self._value(reader, "file", None)
        path = "" if asset is None else asset.resolvedPath
        try:
            bitmap = mi.Bitmap(path)
        except RuntimeError:
            self.note(reader.GetPrim(), f"texture {asset} cannot be read; ignored")
            return fallback
        space = str(self._value(reader, "sourceColorSpace", "auto"))
        linear = space == "raw" or (space == "auto" and not bitmap.srgb_gamma())
        bitmap.set_srgb_gamma(not linear)
        flat = bitmap.convert(component_format=mi.Struct.Type.Float32, srgb_gamma=False)
        pixels = np.atleast_3d(np.array(flat))
        pixels = self._scaled(reader, pixels)
        if isinstance(default, float):
            pixels = pixels[..., [min(CHANNELS.get(output, 0), pixels.shape[-1] - 1)]]
        elif pixels.shape[-1] < 3:
            pixels = np.repeat(pixels[..., :1], 3, -1)
        else:
            pixels = pixels[..., :3]
        data = np.ascontiguousarray(pixels, np.float32)
        return {"type": "bitmap", "bitmap": mi.Bitmap(data), "raw": True,
                "wrap_mode": self._wrap(reader)}  # fmt: skip

    def _scaled(self, reader: Any, pixels: np.ndarray) -> np.ndarray:
        """Texture values after the reader's scale and bias."""
        count = pixels.shape[-1]
        scale = np.asarray(self._value(reader, "scale", [1.0] * 4), np.float32)[:count]
        bias = np.asarray(self._value(reader, "bias", [0.0] * 4), np.float32)[:count]
        return np.clip(pixels * scale + bias, 0, None)

    def _wrap(self, reader: Any) -> str:
        wrap = str(self._value(reader, "wrapS", "useMetadata"))
        return {"clamp": "clamp", "mirror": "mirror"}.get(wrap, "repeat")


def _rgb(value: list[float]) -> dict[str, Any]:
    return {"type": "rgb", "value": value}
