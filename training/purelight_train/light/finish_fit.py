"""The finish that does most nearly what a material does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE
from purelight_format.members.finishes import LARGEST_IOR, RGB, WHITE, Finish
from purelight_format.reflection import EDGE, SHARP, answer, dielectric, mean_reflectance
from purelight_train.light.material_probe import (
    DIFFUSE,
    GLOSSY,
    MIRRORED,
    PASSED,
    RETRO,
    Asked,
    Material,
)

MOST_DIELECTRIC = 0.2  # reflectance at right angles; beyond, it is a metal
LEAST = 2e-3  # of the light: less is none
NEARLY = 0.97  # a tint that is known no better than that is none
ROUNDS = 3  # of making up for what the closed form lacks
POINTS = 24, 48  # of quadrature: facets by tilt and turn
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lobes:
    """Colours of a material's reflections, each [3].

    Arguments:
        diffuse: of even light.
        normal, edge: specular, of light at right angles and at 82 degrees from the normal.
        all: of even light, whichever way.
    """

    diffuse: Array
    normal: Array
    edge: Array
    all: Array


def finish_of(material: Material, name: str, index: float, *, smooth: bool) -> Finish:
    """The finish of a side of a material.

    Arguments:
        index: of refraction behind the surface over that before it; 1 where nothing refracts.
        smooth: whether its normals are interpolated over the facets.
    """
    even, straight = material.ask(), material.ask(1.0)
    passed = float(np.clip(even.part(*PASSED).max(), 0, 1))
    width = straight.width
    given = Finish(
        name, WHITE, roughness=float(np.sqrt(width)), smooth=smooth,
        opacity=1.0 if passed < LEAST else 1 - passed,
    )  # fmt: skip
    lobes = _lobes(material, even, straight)
    first = lobes.normal / _reflected(given, 1.0)
    if lobes.normal.max() < LEAST:
        made = _based(replace(given, ior=1.0, roughness=0.5), lobes.diffuse)
    elif float(LUMINANCE @ first) > MOST_DIELECTRIC:
        made = _metal(given, first, lobes.edge / _reflected(given, EDGE), lobes.diffuse)
    else:
        made = _dielectric(given, first, lobes.diffuse, max(index, 1 / max(index, 1e-3)))
    return _mended(made, lobes.all)


def _lobes(material: Material, even: Asked, straight: Asked) -> Lobes:
    """Tells diffuse from specular reflection; samples of both may each weigh for both."""
    edge = material.ask(EDGE)
    glossy, diffuse = (
        any(a.are(kind).any() for a in (even, straight)) for kind in (GLOSSY, DIFFUSE)
    )
    scattered = (GLOSSY, DIFFUSE)
    own = even.part(DIFFUSE)
    if glossy and diffuse:
        own = np.minimum(material.sent_back() * _SENT_BACK, even.part(*scattered))
    specular = [
        asked.part(MIRRORED)
        + (np.maximum(asked.part(*scattered) - own * share, 0) if glossy else 0)
        for asked, share in ((straight, _AT_NORMAL), (edge, _AT_EDGE))
    ]
    normal, slant = specular
    return Lobes(own, normal, slant, even.part(MIRRORED, *scattered))


def _under_coat(cosine: float) -> float:
    """How much of a usual coat's diffuse reflection of even light goes to one direction."""
    coat = Finish("", WHITE)
    kept = 1 - dielectric(np.array([cosine]), coat)[0, 0]
    return float(kept / (1 - mean_reflectance(coat)[0]))


_AT_NORMAL, _AT_EDGE, _SENT_BACK = _under_coat(1.0), _under_coat(EDGE), _under_coat(RETRO) ** -2


def _metal(given: Finish, first: Array, edge: Array, diffuse: Array) -> Finish:
    """A metal, mixed with a diffuse reflection if there is one."""
    share = float(LUMINANCE @ first / (LUMINANCE @ (first + diffuse)))
    share = 1.0 if share > 1 - 10 * LEAST else share
    base = np.clip(first + (diffuse if share < 1 else 0), 0, 1)
    schlick = base + (1 - base) * (1 - EDGE) ** 5
    tint = np.clip(edge / np.maximum(share * schlick, 1e-9), 0, 1)
    return _based(replace(given, metalness=share, specular_color=_tint(tint), ior=1.0), base)


def _dielectric(given: Finish, first: Array, diffuse: Array, index: float) -> Finish:
    """A dielectric; what mirrors light and lets it through unbent is a sheet."""
    if diffuse.max() > LEAST:  # Told apart from the diffuse reflection, its colour is only noise.
        first = np.full(3, LUMINANCE @ first)
    largest = float(first.max())
    refracts = index > 1 + LEAST
    thin = not refracts and not given.opaque
    root = np.sqrt(largest / (2 - largest) if thin else largest)
    ior = float(min(index if refracts else (1 + root) / (1 - root), LARGEST_IOR))
    tint = first / (max(((ior - 1) / (ior + 1)) ** 2, 1e-9) if refracts else largest)
    coat = replace(given, ior=ior, thin_walled=thin, specular_color=_tint(np.clip(tint, 0, 1)))
    return _based(coat, diffuse / np.maximum(1 - mean_reflectance(coat), 1e-3))


def _mended(given: Finish, wanted: Array) -> Finish:
    """The finish with the base colour that reflects the right part of even light."""
    for _ in range(ROUNDS if max(given.base_color) > LEAST else 0):
        lacking = wanted - reflected_of_even(given)
        if given.metalness > 0:
            factor = 1 + lacking / np.maximum(wanted, LEAST)
            given = _based(given, np.array(given.base_color) * factor)
        else:
            given = _based(given, np.array(given.base_color) + lacking)
    return given


def _reflected(given: Finish, cosine: float) -> float:
    """How much a specular lobe of that roughness reflects if each facet reflects all."""
    white = replace(given, base_color=WHITE, metalness=1.0, specular_color=WHITE, opacity=1.0)
    return float(reflected(white, cosine)[0])


def reflected_of_even(finish: Finish) -> Array:
    """Part of even light that a finish reflects: [3]."""
    x, weight = np.polynomial.legendre.leggauss(12)
    cosines = (x + 1) / 2
    parts = np.array([reflected(finish, float(c)) for c in cosines])
    result: Array = (weight * cosines) @ parts
    return result


def reflected(finish: Finish, cosine: float) -> Array:
    """Part of light that a finish reflects, from one angle to the normal: [3].

    By quadrature over the hemisphere, and over the facets of its specular lobe.
    """
    return _integrated(replace(finish, name=""), cosine).copy()


@lru_cache(1 << 12)  # Lamps have many parts, each of a material that the others have as well
def _integrated(finish: Finish, cosine: float) -> Array:
    seen = np.array([[np.sqrt(1 - cosine**2), 0.0, cosine]])
    u, turn = _points()
    z, angle = (a.ravel() for a in np.meshgrid(np.sqrt(u), turn, indexing="ij"))
    diffuse = _diffuse(finish, seen, _around(z, angle), z / np.pi)
    if finish.roughness**2 >= SHARP:
        return diffuse + _glossy(finish, seen)
    mirrored = answer(finish, _up(1), seen, seen, np.zeros((1, 3))).mirrored[0]
    result: Array = diffuse + mirrored
    return result


def _points() -> tuple[Array, Array]:
    """Places of the quadrature: numbers in [0, 1], and turns in radians."""
    rows, columns = POINTS
    return (np.arange(rows) + 0.5) / rows, 2 * np.pi * (np.arange(columns) + 0.5) / columns


def _glossy(finish: Finish, seen: Array) -> Array:
    """Part of light from one direction [1, 3] that goes into a specular lobe: [3]."""
    u, turn = _points()
    square = finish.roughness**4
    cosine = np.sqrt((1 - u) / (1 + (square - 1) * u))
    tilt, angle = (a.ravel() for a in np.meshgrid(cosine, turn, indexing="ij"))
    facet = _around(tilt, angle)
    between = facet @ seen[0]
    light = 2 * between[:, None] * facet - seen
    density = square / (np.pi * ((square - 1) * tilt**2 + 1) ** 2) * tilt
    pdf_solid_angle = np.maximum(density / (4 * np.maximum(np.abs(between), 1e-12)), 1e-30)
    bare = replace(finish, base_color=finish.base_color if finish.metalness else (0.0, 0.0, 0.0))
    both = _sum(bare, seen, light, pdf_solid_angle)
    return both - _diffuse(bare, seen, light, pdf_solid_angle)


def _diffuse(finish: Finish, seen: Array, light: Array, pdf_solid_angle: Array) -> Array:
    return _sum(replace(finish, roughness=0.0), seen, light, pdf_solid_angle)


def _sum(finish: Finish, seen: Array, light: Array, pdf_solid_angle: Array) -> Array:
    """Mean of what is reflected over directions [N, 3] that were drawn by a pdf [N]: [3]."""
    many = np.broadcast_to(seen, light.shape)
    value = answer(finish, _up(len(light)), many, light, np.zeros(light.shape)).reflected
    result: Array = (value / pdf_solid_angle[:, None]).mean(0)
    return result


def _around(z: Array, turn: Array) -> Array:
    across = np.sqrt(np.maximum(1 - z * z, 0))
    return np.stack((across * np.cos(turn), across * np.sin(turn), z), 1)


def _up(count: int) -> Array:
    return np.tile([0.0, 0.0, 1.0], (count, 1))


def _based(given: Finish, base: Array) -> Finish:
    return replace(given, base_color=_rgb(base))


def _tint(values: Array) -> RGB:
    return _rgb(np.where(values > NEARLY, 1, values))


def _rgb(values: Array) -> RGB:
    r, g, b = (round(float(x), 5) for x in np.clip(values, 0, 1))
    return r, g, b
