"""Finishes of the lamps of a scene on the device: what their surfaces do with other light.

The equations are those of spec/finishes.md, independent of `purelight_format.reflection` on
purpose: a mistake in either shows where they are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.members.finishes import Finish
from purelight_format.reflection import EDGE, SHARP, mean_reflectance
from purelight_mitsuba.device_array import device_array

PACKETS = 8  # Of four floats per finish.


@dataclass
class Look:
    """The finish of one side of a triangle per lane.

    Arguments:
        known: Whether it has one.
        base: Reflectance of the metal at right angles.
        slope: What a metal lacks of Schlick's reflectance toward grazing.
        tint: Of the dielectric's specular reflection.
        diffuse: Colour of the diffuse reflection.
        even: One over the part of even light that the dielectric lets in, over pi.
        spread: Part of the transmittance that does not go straight.
        ahead, back: Parts that leave ahead besides, and that come back.
        ahead_exponent, back_exponent: Of their lobes.
    """

    known: mi.Bool
    base: mi.Color3f
    slope: mi.Color3f
    tint: mi.Color3f
    diffuse: mi.Color3f
    even: mi.Color3f
    ahead: mi.Color3f
    back: mi.Color3f
    metalness: mi.Float
    alpha: mi.Float
    ior: mi.Float
    thin: mi.Bool
    opaque: mi.Bool
    spread: mi.Float
    ahead_exponent: mi.Float
    back_exponent: mi.Float

    @property
    def sheet(self) -> mi.Bool:
        """Whether it is thin glass, with as much light behind as before it."""
        return self.thin & ~self.opaque

    @property
    def sharp(self) -> mi.Bool:
        """Whether its specular reflection is a mirror's."""
        return self.alpha < SHARP

    def dielectric(self, cosine: mi.Float) -> mi.Color3f:
        """Reflectance of the dielectric, Eqs. 14 and 15."""
        single = dr.select(self.ior > 1, mi.fresnel(dr.abs(cosine), self.ior)[0], 0)
        return self.tint * dr.select(self.thin, 2 * single / (1 + single), single)

    def reflectance(self, cosine: mi.Float) -> mi.Color3f:
        """Specular reflectance, Eqs. 16 and 17."""
        c = dr.clip(dr.abs(cosine), 0, 1)
        square = dr.square(1 - c)
        fifth = dr.square(square) * (1 - c)
        metal = dr.clip(
            dr.fma(1 - self.base, fifth, self.base) - self.slope * c * fifth * (1 - c), 0, 1
        )
        return dr.lerp(self.dielectric(c), metal, self.metalness)

    def kept(self, cosine: mi.Float) -> mi.Color3f:
        """Part of the light that the dielectric lets in."""
        return 1 - self.dielectric(cosine)


class Finishes:
    """Finishes on the device, at least one.

    Arguments:
        finishes: Of all lamps.
    """

    def __init__(self, finishes: Sequence[Finish]) -> None:
        rows = [row(finish) for finish in finishes]
        self._table = device_array(mi.Float, rows)
        self._count = len(rows)

    def look(self, index: mi.UInt32, active: mi.Bool) -> Look:
        """Looks up finishes."""
        known = active & (index < self._count)
        a, b, c, d, e, f, g, h = (
            dr.gather(mi.Vector4f, self._table, index * PACKETS + k, known) for k in range(PACKETS)
        )
        return Look(
            known=known,
            base=mi.Color3f(a.x, a.y, a.z),
            slope=mi.Color3f(b.x, b.y, b.z),
            tint=mi.Color3f(c.x, c.y, c.z),
            diffuse=mi.Color3f(d.x, d.y, d.z),
            even=mi.Color3f(e.x, e.y, e.z),
            ahead=mi.Color3f(f.x, f.y, f.z),
            back=mi.Color3f(g.x, g.y, g.z),
            metalness=a.w,
            alpha=b.w,
            ior=c.w,
            thin=known & (d.w > 0),
            opaque=known & (e.w > 0),
            spread=f.w,
            ahead_exponent=g.w,
            back_exponent=h.x,
        )


def row(finish: Finish) -> np.ndarray:
    """A finish as `Finishes.look` reads it: [PACKETS * 4]."""
    base, tint = np.array(finish.base_color), np.array(finish.specular_color)
    edge = base + (1 - base) * (1 - EDGE) ** 5
    slope = edge * (1 - tint) / (EDGE * (1 - EDGE) ** 6)
    even = 1 / (np.pi * np.maximum(1 - mean_reflectance(finish), 1e-6))
    ahead, back = (
        np.array(c) * (not finish.opaque) for c in (finish.scattered_ahead, finish.scattered_back)
    )
    spread = finish.spread * (not finish.opaque)
    return np.array([
        *base, finish.metalness, *slope, finish.roughness**2, *tint, finish.ior,
        *finish.diffuse, finish.thin_walled, *even, finish.opaque, *ahead, spread,
        *back, finish.ahead_exponent, finish.back_exponent, 0, 0, 0,
    ])  # fmt: skip
