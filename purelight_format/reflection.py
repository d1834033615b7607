"""What a finish does with light: the reference of spec/finishes.md, in NumPy.

Directions are unit vectors that leave the surface: `outgoing` toward the viewer, `incoming`
toward the light. Values are the BSDF times the cosine of `incoming` to the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_format.members.finishes import Finish

Array = NDArray[np.floating]
SHARP = 1e-3  # GGX width below which a reflection is a mirror's.
EDGE = 1 / 7  # Cosine at which a metal's `specular_color` holds, that of 82 degrees.
NODES = 64  # Of the quadrature of the mean reflectance.


@dataclass(frozen=True)
class Answer:
    """What becomes of light at a finish; all are [N, 3].

    Arguments:
        reflected: diffuse reflection and a specular lobe that is not sharp, per solid angle.
        mirrored: part of the light from the mirror direction, of a sharp specular reflection.
        spread: of what goes on ahead but not straight, per solid angle.
        straight: part of the light from straight behind.
    """

    reflected: Array
    mirrored: Array
    spread: Array
    straight: Array


def fresnel(cosine: Array, ior: float) -> Array:
    """Reflectance of unpolarised light at a dielectric with the index behind it (Eq. 14)."""
    one, c = cosine.dtype.type(1), np.clip(np.abs(cosine), 0, 1)
    g = np.sqrt(np.maximum(ior * ior - one + c * c, 0))
    s = ((g - c) / np.maximum(g + c, np.finfo(c.dtype).tiny)) ** 2
    inner = (c * (g + c) - one) / (c * (g - c) + one)
    return s * (one + inner * inner) / 2 if ior != 1 else np.zeros_like(c)


def dielectric(cosine: Array, finish: Finish) -> Array:
    """Reflectance of a dielectric, or of a sheet of it (Eq. 15): [N] -> [N, 3]."""
    reflectance = fresnel(cosine, finish.ior)
    if finish.thin_walled:
        reflectance = 2 * reflectance / (1 + reflectance)
    return reflectance[:, None] * np.asarray(finish.specular_color, cosine.dtype)


def metal(cosine: Array, finish: Finish) -> Array:
    """Reflectance of a metal, by Schlick with OpenPBR's F82 tint (Eq. 16): [N] -> [N, 3]."""
    normal = np.asarray(finish.base_color, cosine.dtype)
    tint = np.asarray(finish.specular_color, cosine.dtype)
    c = np.clip(np.abs(cosine), 0, 1)[:, None]
    schlick = normal + (1 - normal) * (1 - c) ** 5
    edge = normal + (1 - normal) * (1 - EDGE) ** 5
    slope = edge * (1 - tint) / (EDGE * (1 - EDGE) ** 6)
    return np.clip(schlick - slope * c * (1 - c) ** 6, 0, 1)


def reflectance(cosine: Array, finish: Finish) -> Array:
    """Specular reflectance (Eq. 17): [N] -> [N, 3]."""
    share = cosine.dtype.type(finish.metalness)
    mixed: Array = (1 - share) * dielectric(cosine, finish) + share * metal(cosine, finish)
    return mixed


def mean_reflectance(finish: Finish) -> NDArray[np.float64]:
    """Reflectance of the dielectric under even light, the mean of 2 c F(c): [3]."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    c = (x + 1) / 2
    result: NDArray[np.float64] = (weight * c) @ dielectric(c, finish)
    return result


def answer(
    finish: Finish, normal: Array, outgoing: Array, incoming: Array, transmittance: Array
) -> Answer:
    """What a finish makes of light from `incoming` on its way to `outgoing`.

    Arguments:
        normal: either side; the side of `outgoing` counts.
        transmittance: what the network `transparency` says there.
    """
    dtype = outgoing.dtype
    facing = np.where((normal * outgoing).sum(1, keepdims=True) < 0, -normal, normal)
    near, far = (facing * outgoing).sum(1), (facing * incoming).sum(1)
    kept = 1 - dielectric(near, finish)
    diffuse, through = (np.asarray(c, dtype) for c in (finish.diffuse, finish.diffuse_transmission))
    lambert = diffuse * kept * _evenly(far, finish) * np.maximum(far, 0)[:, None]
    sharp = finish.roughness**2 < SHARP
    glossy = 0 if sharp else _lobe(finish, facing, outgoing, incoming)
    above = ((near > 0) & (far > 0))[:, None]
    # What passes: no more than is left
    left = np.maximum(1 - reflectance(near, finish) - kept * (diffuse + through), 0)
    passing = np.minimum(transmittance, left) * (finish.opacity < 1)
    lobe = _ahead(finish, -(outgoing * incoming).sum(1))[:, None]
    spread = dtype.type(finish.spread)
    return Answer(
        reflected=np.where(above, lambert + glossy, 0),
        mirrored=reflectance(near, finish) * sharp,
        spread=(kept * through * (finish.opacity < 1) + passing * spread) * lobe,
        straight=passing * (1 - spread),
    )


def _evenly(cosine: Array, finish: Finish) -> Array:
    """Light that a dielectric lets in or out, of a mean of 1 / pi under even light (Eq. 19)."""
    mean = np.asarray(mean_reflectance(finish), cosine.dtype)
    result: Array = (1 - dielectric(cosine, finish)) / (np.pi * np.maximum(1 - mean, 1e-6))
    return result


def _lobe(finish: Finish, normal: Array, outgoing: Array, incoming: Array) -> Array:
    """The specular lobe, GGX with separable Smith shadowing (Eq. 18): [N, 3]."""
    half = outgoing + incoming
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-30)
    near, far, tilt, between = (
        (a * b).sum(1)
        for a, b in ((normal, outgoing), (normal, incoming), (normal, half), (half, outgoing))
    )
    square = np.asarray(finish.roughness**4, outgoing.dtype)
    density = square / (np.pi * ((square - 1) * tilt * tilt + 1) ** 2)
    shadow = _smith(near, square) * _smith(far, square)
    value = density * shadow / (4 * np.maximum(near, 1e-30))
    return reflectance(between, finish) * value[:, None]


def _smith(cosine: Array, square: Array) -> Array:
    c = np.maximum(cosine, 1e-15)  # Whose square single precision holds.
    result: Array = 2 / (1 + np.sqrt(1 + square * (1 / (c * c) - 1)))
    return result


def _ahead(finish: Finish, cosine: Array) -> Array:
    """Density of the lobe about the straight line, per solid angle (Eq. 20)."""
    k = finish.spread_exponent
    result: Array = (k + 1) / (2 * np.pi) * np.maximum(cosine, 0) ** k * (cosine > 0)
    return result
