"""Pictures on surfaces: colours, or numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.srgb import encode

LEVELS = 256
UPSIDE_DOWN = np.array([[1.0, 0, 0], [0, -1, 1], [0, 0, 1]])  # The inverse of itself.


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture and how it lies on a surface.

    Arguments:
        name: what to call its file.
        pixels: [H, W, C] of uint8, or linear float32; the first row is the upper one.
        srgb: whether bytes are sRGB-encoded colours; otherwise they are numbers over 255.
        wrap: `repeat`, `clamp` or `mirror` outside of the unit square.
        to_uv: [3, 3] transform of texture coordinates; None is none.
        smooth: whether values between pixels are interpolated.
    """

    name: str
    pixels: NDArray[Any]
    srgb: bool = False
    wrap: str = "repeat"
    to_uv: NDArray[np.float64] | None = None
    smooth: bool = True

    @cached_property
    def linear(self) -> NDArray[np.float32]:
        """Values as linear numbers: [H, W, C]."""
        if self.pixels.dtype != np.uint8:
            return self.pixels.astype(np.float32)
        level = np.arange(LEVELS) / (LEVELS - 1)
        table = decode(level) if self.srgb else level
        values: NDArray[np.float32] = table.astype(np.float32)[self.pixels]
        if self.srgb and values.shape[2] in (2, 4):  # Coverage is never encoded.
            values[..., -1] = self.pixels[..., -1] / np.float32(LEVELS - 1)
        return values

    def channels(self, *which: int) -> Picture:
        """With some of its channels only; the last one there is for those that it lacks."""
        last = self.pixels.shape[2] - 1
        chosen = [min(k, last) for k in which]
        alpha = self.srgb and chosen == [last] and last in (1, 3)
        return replace(self, pixels=self.pixels[..., chosen], srgb=self.srgb and not alpha)

    def colors(self) -> Picture:
        """With three channels, those of grey pictures repeated."""
        return self.channels(*((0, 1, 2) if self.pixels.shape[2] > 2 else (0, 0, 0)))

    def times(self, factor: Any) -> Picture:
        """With all values multiplied, by a number or a colour."""
        factor = np.asarray(factor, np.float32)
        if (factor == 1).all():
            return self
        return replace(self, pixels=self.linear * factor, srgb=False)

    def lies_as(self, other: Picture) -> bool:
        """Whether both lie in the same way on a surface."""
        one, two = (np.eye(3) if p.to_uv is None else p.to_uv for p in (self, other))
        return self.wrap == other.wrap and bool(np.allclose(one, two))

    def by(self, other: Picture) -> Picture:
        """Times the first channel of a picture that lies as this one, with the finer's pixels."""
        height, width = np.maximum(self.pixels.shape[:2], other.pixels.shape[:2])
        v, u = np.mgrid[:height, :width]
        place = np.stack(((u + 0.5) / width, (v + 0.5) / height), -1).reshape(-1, 2)
        one, two = (replace(p, to_uv=None).at(place) for p in (self, other))
        return replace(self, pixels=(one * two[:, :1]).reshape(height, width, -1), srgb=False)

    def under(self, matrix: NDArray[np.float64]) -> Picture:
        """With a transform [3, 3] of coordinates whose origin is the lower left corner."""
        if np.array_equal(matrix, np.eye(3)):
            return self
        return replace(self, to_uv=UPSIDE_DOWN @ matrix @ UPSIDE_DOWN)

    def mean(self) -> NDArray[np.float64]:
        """Mean linear value of each channel: [C]."""
        return self.linear.mean((0, 1), dtype=np.float64)

    def at(self, uv: NDArray[Any]) -> NDArray[np.float32]:
        """Linear values of the pixels at texture coordinates [N, 2]: [N, C]."""
        if self.to_uv is not None:
            uv = uv @ self.to_uv[:2, :2].T + self.to_uv[:2, 2]
        if self.wrap == "clamp":
            uv = np.clip(uv, 0, 1)
        elif self.wrap == "mirror":
            uv = 1 - np.abs(uv % 2 - 1)
        size = np.array(self.pixels.shape[1::-1])
        column, row = (np.floor(uv % 1 * size).astype(np.int64) % size).T
        if self.wrap == "clamp":
            column, row = np.minimum(np.floor(uv * size).astype(np.int64), size - 1).T
        return self.linear[row, column]

    @property
    def above_one(self) -> bool:
        """Whether bytes could not tell all of its values."""
        return self.pixels.dtype != np.uint8 and bool((self.linear > 1 + 1 / LEVELS).any())

    def bytes(self) -> tuple[NDArray[np.uint8], bool]:
        """Pixels as bytes, and whether they are sRGB-encoded; values above one are cut."""
        if self.pixels.dtype == np.uint8:
            return self.pixels, self.srgb
        values = np.clip(self.linear, 0, 1)
        color = values.shape[2] == 3
        shown = encode(values) if color else values
        return np.rint((LEVELS - 1) * shown).astype(np.uint8), color


def decode(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """The inverse transfer curve of IEC 61966-2-1: [...] in [0, 1] -> linear."""
    result: NDArray[np.float64] = np.where(
        encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4
    )
    return result


def mean_of(value: Any) -> Any:
    """The mean of a picture, and a number or colour as it is."""
    if not isinstance(value, Picture):
        return value
    mean = value.mean()
    return float(mean[0]) if len(mean) == 1 else tuple(mean.tolist())
