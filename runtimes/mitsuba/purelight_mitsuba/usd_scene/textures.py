"""`UsdUVTexture` as Mitsuba's `bitmap`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.usd_scene.shader_inputs import (
    CHANNELS,
    upstream,
    uv_transform,
    value,
    wrap_mode,
)
from purelight_mitsuba.usd_scene.values import Values, within

SCALE_BIAS = (("scale", (1.0,) * 4), ("bias", (0.0,) * 4))
DECODED = (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0)  # Scale and bias of normal maps.


@dataclass(frozen=True)
class Textures:
    """Reads textures.

    Arguments:
        values: How attributes are read.
        note: Is told of what is rendered otherwise.
        flat: Whether the shapes have no texture coordinates: pictures are then read at one point,
            the fallback of the primvar's reader, as in USD.
    """

    values: Values
    note: Callable[[Any, str], None]
    flat: bool = False

    def number(self, reader: Any, output: str) -> dict[str, Any] | float | None:
        """The channel of an output, [0, 1]; None where the texture cannot be read."""
        pixels = self._pixels(reader)
        if pixels is None:
            return None
        names = CHANNELS[pixels.shape[-1]]
        if output == "a" and "a" not in names:
            opaque = sum(value(reader, n, d, self.values)[3] for n, d in SCALE_BIAS)
            return float(within(opaque))
        bitmap = self._bitmap(reader, within(pixels[..., [max(names.find(output), 0)]]))
        return self._at_fallback(reader, bitmap)[0] if self.flat else bitmap

    def color(self, reader: Any, most: float = 1.0) -> dict[str, Any] | None:
        """A colour from 0 to the most, linear; None where the texture cannot be read."""
        pixels = self._pixels(reader)
        if pixels is None:
            return None
        bitmap = self._bitmap(reader, within(_three(pixels), most))
        return {"type": "rgb", "value": self._at_fallback(reader, bitmap)} if self.flat else bitmap

    def normal(self, reader: Any, *, mirrored: bool = False) -> dict[str, Any] | None:
        """Normals in tangent space as Mitsuba codes them, 0.5 + 0.5 n; None if not to be read.

        Arguments:
            mirrored: For triangles on which the picture is a mirror image.
        """
        if self.flat:
            self.note(reader.GetPrim(), "a normal map without texture coordinates; ignored")
            return None
        pixels = self._pixels(reader, raw=True, scale_bias=self._decoding(reader))
        if pixels is None:
            return None
        normal = _three(pixels)
        if mirrored:
            normal = normal * np.array([1, -1, 1], np.float32)
        return self._bitmap(reader, 0.5 + 0.5 * normal)

    def _at_fallback(self, reader: Any, bitmap: dict[str, Any]) -> list[float]:
        """The three channels of a picture where coordinates are missing."""
        self.note(reader.GetPrim(), "a texture without texture coordinates; read at one point")
        source = upstream(reader, "UsdPrimvarReader_float2")
        place = value(source, "fallback", (0, 0), self.values) if source else (0, 0)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv = mi.Point2f(*map(float, place))
        return [float(v) for v in np.ravel(mi.load_dict(bitmap).eval(si))]

    def _decoding(self, reader: Any) -> tuple[Any, Any]:
        """Scale and bias of a normal map."""
        found = [value(reader, name, None, self.values) for name in ("scale", "bias")]
        if found == [None, None]:
            self.note(reader.GetPrim(), "a normal map without scale and bias, read as 2 x - 1")
            return DECODED
        scale, bias = (d if f is None else f for f, (_, d) in zip(found, SCALE_BIAS, strict=True))
        return scale, bias

    def _pixels(
        self, reader: Any, *, raw: bool = False, scale_bias: tuple[Any, Any] | None = None
    ) -> np.ndarray | None:
        """[H, W, channels] float32 after scale and bias, upper row first."""
        if reader.GetIdAttr().Get() != "UsdUVTexture":
            self.note(reader.GetPrim(), f"{reader.GetIdAttr().Get()} is not supported; ignored")
            return None
        asset = value(reader, "file", None, self.values)
        try:
            bitmap = mi.Bitmap("" if asset is None else asset.resolvedPath)
        except RuntimeError:
            self.note(reader.GetPrim(), f"texture {asset} cannot be read; ignored")
            return None
        space = str(value(reader, "sourceColorSpace", "auto", self.values))
        coded = {"raw": False, "sRGB": True}.get(space, _coded(bitmap))
        bitmap.set_srgb_gamma(coded and not raw)
        flat = bitmap.convert(component_format=mi.Struct.Type.Float32, srgb_gamma=False)
        pixels = np.atleast_3d(np.array(flat))[..., :4]
        found = scale_bias or [value(reader, n, d, self.values) for n, d in SCALE_BIAS]
        own = ["rgba".index(name) for name in CHANNELS[pixels.shape[-1]]]
        scale, bias = (np.asarray(a, np.float32)[own] for a in found)
        return pixels * scale + bias

    def _bitmap(self, reader: Any, pixels: np.ndarray) -> dict[str, Any]:
        """(0, 0) is the lower left corner of a picture in USD, the upper left one in Mitsuba."""
        data = np.ascontiguousarray(pixels[::-1], np.float32)
        matrix, flat = np.eye(4), uv_transform(reader, self.values)
        matrix[:2, :2], matrix[:2, 3] = flat[:2, :2], flat[:2, 2]
        return {"type": "bitmap", "bitmap": mi.Bitmap(data), "raw": True,
                "wrap_mode": wrap_mode(reader, self.values),
                "to_uv": mi.ScalarTransform4f(matrix)}  # fmt: skip


def _coded(bitmap: mi.Bitmap) -> bool:
    """Whether a picture of which no colour space is stated is sRGB: a colour one of 8 bits."""
    eight = bitmap.component_format() == mi.Struct.Type.UInt8
    return bool(eight and bitmap.channel_count() > 2 and bitmap.srgb_gamma())


def _three(pixels: np.ndarray) -> np.ndarray:
    """Three channels of a picture of any number."""
    return pixels[..., :3] if pixels.shape[-1] > 2 else np.repeat(pixels[..., :1], 3, -1)
