"""UsdPreviewSurface as Mitsuba's `principled`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_mitsuba.usd_scene.shader_inputs import connected, value
from purelight_mitsuba.usd_scene.textures import Textures
from purelight_mitsuba.usd_scene.values import Values, within

PLAIN = 0.18  # Diffuse grey of a UsdPreviewSurface, and of prims without a material.
IGNORED = ("displacement", "occlusion")
DARK = [0.0] * 3
LARGEST_IOR = 4.0


@dataclass(frozen=True)
class Look:
    """How a surface looks.

    Arguments:
        bsdf: Its material.
        mirrored: The same for triangles on which the picture is a mirror image; None if it does
            not matter.
        radiance: That it emits, as Mitsuba's dictionary of a colour or a picture, or None.
    """

    bsdf: mi.BSDF
    mirrored: mi.BSDF | None = None
    radiance: dict[str, Any] | None = None

    def emitter(self, shape: Callable[[], mi.Shape]) -> mi.Emitter | None:
        """A light for one shape more.

        Arguments:
            shape: Makes another one like it.
        """
        if self.radiance is None:
            return None
        if self.radiance["type"] == "rgb":
            return mi.load_dict({"type": "area", "radiance": self.radiance})
        from purelight_mitsuba.usd_scene.area_light import TexturedArea  # Needs a variant

        return TexturedArea(mi.load_dict(self.radiance), shape())


@dataclass
class PreviewSurface:
    """Reads one shader.

    Arguments:
        shader: The UsdPreviewSurface.
        values: How attributes are read.
        note: Is told of what is rendered otherwise.
        flat: Whether its shapes have no texture coordinates.
    """

    shader: Any
    values: Values
    note: Callable[[Any, str], None]
    flat: bool = False

    def __post_init__(self) -> None:
        self._textures = Textures(self.values, self.note, self.flat)

    def look(self) -> Look:
        """The material, made anew."""
        shader = self.shader
        for name in IGNORED:
            if shader.GetInput(name) and shader.GetInput(name).HasConnectedSource():
                self.note(shader.GetPrim(), f"{name} map is not supported and was ignored")
        inner, opacity = self._principled(), self._opacity()
        emissive = self._input("emissiveColor", DARK, most=np.inf)
        radiance = None if emissive == rgb(DARK) else emissive
        plain, mirrored = (self._normal_map(inner, mirrored=m) for m in (False, True))
        if plain is None:
            return Look(_covered(inner, opacity), None, radiance)
        return Look(_covered(plain, opacity), _covered(mirrored, opacity), radiance)

    def _principled(self) -> dict[str, Any]:
        specular = bool(self._value("useSpecularWorkflow", 0))
        if specular:
            self.note(self.shader.GetPrim(), "specular workflow rendered by its diffuse colour")
        roughness = self._input("roughness", 0.5)
        return {
            "type": "principled",
            "base_color": self._input("diffuseColor", [PLAIN] * 3),
            "metallic": 0.0 if specular else self._input("metallic", 0.0),
            "roughness": max(roughness, 0.02) if isinstance(roughness, float) else roughness,
            "eta": max(self._number("ior", 1.5, LARGEST_IOR), 1.001),
            "clearcoat": self._input("clearcoat", 0.0),
            "clearcoat_gloss": 1 - self._number("clearcoatRoughness", 0.01),
        }

    def _opacity(self) -> Any:
        """All or nothing about a threshold, where there is one."""
        opacity, threshold = self._input("opacity", 1.0), self._number("opacityThreshold", 0.0)
        if threshold <= 0:
            return opacity
        if isinstance(opacity, float):
            return float(opacity >= threshold)
        whole = np.array(opacity["bitmap"], np.float32) >= threshold
        return opacity | {"bitmap": mi.Bitmap(whole.astype(np.float32))}

    def _normal_map(self, inner: dict[str, Any], *, mirrored: bool) -> dict[str, Any] | None:
        """The surface under its normal map; None where it has none."""
        source = connected(self.shader, "normal")
        texture = self._textures.normal(source[0], mirrored=mirrored) if source else None
        return texture and {"type": "normalmap", "normalmap": texture, "bsdf": inner}

    def _value(self, name: str, default: Any) -> Any:
        return value(self.shader, name, default, self.values)

    def _number(self, name: str, default: float, most: float = 1.0) -> float:
        return self._within(name, [float(self._value(name, default))], most)[0]

    def _within(self, name: str, values: list[float], most: float) -> list[float]:
        """Values from 0 to the most there can be, noted if they were not."""
        cut: list[float] = within(values, most).tolist()
        if not np.allclose(cut, values, rtol=1e-5, atol=0):
            told = f"within 0 and {most:g}" if np.isfinite(most) else "finite and 0 or more"
            self.note(self.shader.GetPrim(), f"{name} is not {told}; cut")
        return cut

    def _input(self, name: str, default: Any, *, most: float = 1.0) -> Any:
        """An input as a number, a colour, or the texture that is connected to it."""
        source, number = connected(self.shader, name), isinstance(default, float)
        if source is not None:
            read = self._textures
            texture = read.number(*source) if number else read.color(source[0], most)
            if texture is not None:
                return texture
            return default if number else rgb(default)
        if number:
            return self._number(name, default, most)
        found = list(map(float, self._value(name, default)))
        return rgb(self._within(name, found, most))


def _covered(inner: dict[str, Any] | None, opacity: Any) -> mi.BSDF:
    """Both sides of a surface, as far as it is opaque."""
    bsdf: dict[str, Any] = {"type": "twosided", "inner": inner}
    if opacity != 1.0:
        bsdf = {"type": "mask", "opacity": opacity, "inner": bsdf}
    return mi.load_dict(bsdf)


def rgb(value: list[float]) -> dict[str, Any]:
    """A linear colour as Mitsuba's dictionary."""
    return {"type": "rgb", "value": value}
