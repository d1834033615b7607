"""Transmittance of lines: closed forms for smooth walls, path tracing for what scatters."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from purelight_format.measures import BoundingSphere

N = 1.5
LINES, THIN = 1 << 17, 2e-3
RADII = np.array([0.0, 0.3, 0.6, 0.8, 0.9])  # how far from the axis lines pass, of the radius


def reflectance(cosine: np.ndarray, index: float = N) -> np.ndarray:
    """Fresnel's, of unpolarised light, at an angle on the side of the lower index."""
    inside = np.sqrt(1 - (1 - cosine**2) / index**2)
    s = (cosine - index * inside) / (cosine + index * inside)
    p = (index * cosine - inside) / (index * cosine + inside)
    return 0.5 * (s**2 + p**2)


def ball(radius: float, *, flip: bool = False, **bsdf: Any) -> dict[str, Any]:
    material = {"type": "dielectric", "int_ior": N, "ext_ior": 1.0, **bsdf}
    return {"type": "sphere", "radius": radius, "flip_normals": flip, "bsdf": material}


def through(mi: Any, parts: dict[str, Any], part: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean transmittance of lines that pass `part` of a radius off the axis, and its error."""
    from purelight_train.light.transmittance import transmittance_samples

    turn = np.linspace(0, 2 * math.pi, LINES)
    origin = np.stack((part * np.cos(turn), part * np.sin(turn), np.full(LINES, 3.0)), 1)
    direction = np.tile(np.float32([0, 0, -1]), (LINES, 1))
    scene = mi.load_dict({"type": "scene", **parts})
    value = transmittance_samples(scene, origin.astype(np.float32), direction, 0)
    return value.mean(0), np.maximum(value.std(0), 1e-3) / math.sqrt(LINES)


def wall(thin: float = THIN) -> dict[str, Any]:
    return {"outer": ball(1.0), "inner": ball(1.0 - thin, flip=True)}


def significant(cases: int) -> float:
    """Deviations that one of so many right results exceeds in one run of a thousand."""
    return float(norm.isf(0.5e-3 / cases))


def slab(part: float, index: float = N) -> float:
    """What a wall lets through whose outer face is met `part` of a radius off the axis."""
    r, s = reflectance(np.sqrt(1 - np.array([part, part / (1 - THIN)]) ** 2), index)
    return float((1 - r) * (1 - s) / (1 - r * s))


@pytest.mark.parametrize("part", RADII)
def test_wall_of_glass(mitsuba: Any, part: float) -> None:
    """Twice (1 - R) / (1 + R), also beyond the 42 degrees at which light inside is trapped."""
    mean, error = through(mitsuba, wall(), part)
    expected = slab(part) ** 2
    if part == 0:  # through the very middle the two walls are parallel as well
        r = reflectance(np.ones(1))
        expected = (1 - r) / (1 + 3 * r)
    assert (np.abs(mean - expected) < significant(len(RADII)) * error + 1e-3).all()


@pytest.mark.parametrize("part", RADII[1:])
def test_solid_glass(mitsuba: Any, part: float) -> None:
    """(1 - R)²: the line meets both faces at the same angle, and they are not parallel."""
    mean, error = through(mitsuba, {"ball": ball(1.0)}, part)
    expected = (1 - reflectance(np.sqrt(1 - part**2))) ** 2
    assert (np.abs(mean - expected) < significant(4) * error + 1e-3).all()


@pytest.mark.parametrize("part", RADII[1:])
def test_nested_shells(mitsuba: Any, part: float) -> None:
    """Each wall at the angle it is met at; the inner ones half as large, of another index."""
    shells = wall() | {
        "second": ball(0.5, int_ior=1.7), "hollow": ball(0.5 * (1 - THIN), flip=True, int_ior=1.7),
    }  # fmt: skip
    mean, error = through(mitsuba, shells, part)
    expected = slab(part) ** 2 * (slab(2 * part, 1.7) ** 2 if part < 0.5 else 1)
    assert (np.abs(mean - expected) < significant(4) * error + 3e-3).all()


@pytest.mark.parametrize("part", RADII)
def test_glass_turned_round(mitsuba: Any, part: float) -> None:
    """A ball whose inside is declared as its outside is the same glass."""
    usual = through(mitsuba, {"ball": ball(1.0)}, part)
    turned = through(mitsuba, {"ball": ball(1.0, flip=True, int_ior=1.0, ext_ior=N)}, part)
    error = np.hypot(usual[1], turned[1])
    assert (np.abs(usual[0] - turned[0]) < significant(len(RADII)) * error).all()


def covered(mi: Any, cover: str) -> dict[str, Any]:
    """Glass in a material that changes its normals, or has holes."""
    glass = ball(1.0)["bsdf"]
    if cover == "mask":
        return {"type": "mask", "opacity": 0.3, "glass": glass}
    name, texel = {"bumpmap": ("bumps", [0.5]), "normalmap": ("normalmap", [0.5, 0.5, 1.0])}[cover]
    data = mi.TensorXf(np.tile(np.float32(texel), (4, 4, 1)))
    return {"type": cover, name: {"type": "bitmap", "raw": True, "data": data}, "glass": glass}


@pytest.mark.parametrize("cover", ["bumpmap", "normalmap", "mask"])
def test_covered_glass_has_the_index_of_glass(mitsuba: Any, cover: str) -> None:
    from purelight_train.light.interfaces import relative_index

    assert relative_index(mitsuba.load_dict(covered(mitsuba, cover))) == pytest.approx(N, rel=1e-3)


@pytest.mark.parametrize("part", RADII[1:])  # a sphere has no slopes at its very pole
def test_glass_with_bumps_of_no_height(mitsuba: Any, part: float) -> None:
    flat = {"ball": {"type": "sphere", "bsdf": covered(mitsuba, "bumpmap")}}
    bumped, usual = through(mitsuba, flat, part), through(mitsuba, {"ball": ball(1.0)}, part)
    error = np.hypot(usual[1], bumped[1])
    assert (np.abs(usual[0] - bumped[0]) < significant(len(RADII)) * error).all()


@pytest.mark.parametrize("part", RADII)
def test_thin_and_tinted_glass(mitsuba: Any, part: float) -> None:
    tint = np.array([0.9, 0.6, 0.3])
    bsdf = {"type": "thindielectric", "specular_transmittance": {"type": "rgb", "value": tint}}
    parts = {"ball": {"type": "sphere", "bsdf": bsdf}}
    mean, error = through(mitsuba, parts, part)
    r = reflectance(np.sqrt(1 - part**2), 1.5046)  # bk7 in air, Mitsuba's default
    expected = ((1 - r) / (1 + r) * tint) ** 2
    assert (np.abs(mean - expected) < significant(len(RADII)) * error + 5e-3).all()


@pytest.mark.parametrize("part", [0.3, 0.6, 0.8])
def test_coloured_walls_absorb_along_the_refracted_ray(mitsuba: Any, part: float) -> None:
    """Two walls of thickness t absorb over 2 t / cos(refracted), not over 2 t / cos.

    Rays begin a little off the faces, which takes a per cent of this thickness off.
    """
    thin, sigma = 0.01, np.array([10.0, 40.0, 100.0])
    medium = {
        "type": "homogeneous", "albedo": 0.0, "scale": 100.0,
        "sigma_t": {"type": "rgb", "value": sigma / 100},
    }  # fmt: skip
    parts = wall(thin)
    parts["outer"]["interior"] = {**medium, "id": "tint"}
    parts["inner"]["interior"] = {"type": "ref", "id": "tint"}
    mean, error = through(mitsuba, parts, part)
    sine = np.array([part, part / (1 - thin)])  # at the outer and at the inner face
    r, s = reflectance(np.sqrt(1 - sine**2))
    length = thin / np.sqrt(1 - (sine.mean() / N) ** 2)
    a = np.exp(-sigma * length)
    expected = ((1 - r) * (1 - s) * a / (1 - r * s * a**2)) ** 2
    assert (np.abs(mean - expected) < significant(3) * error + 0.04 * expected).all()


SCATTERING = {
    "rough outside": {
        "outer": ball(1.0, type="roughdielectric", alpha=0.3), "inner": ball(0.96, flip=True),
    },
    "rough inside": {
        "outer": ball(1.0), "inner": ball(0.96, flip=True, type="roughdielectric", alpha=0.2),
    },
    "solid rough": {"ball": ball(1.0, type="roughdielectric", alpha=0.2)},
    "cloud": {
        "ball": {
            "type": "sphere", "bsdf": {"type": "null"},
            "interior": {
                "type": "homogeneous", "albedo": 0.9, "sigma_t": 0.8,
                "phase": {"type": "hg", "g": 0.7},
            },
        },
    },
}  # fmt: skip


@pytest.mark.parametrize("name", SCATTERING)
def test_what_scatters_is_what_an_even_background_shows(mitsuba: Any, name: str) -> None:
    """Mean over the disc, against Mitsuba's volumetric path tracer before half a space of light."""
    from purelight_train.light.transmittance import transmittance_samples
    from purelight_train.truth.backlit import Backlit

    scene = mitsuba.load_dict({"type": "scene", **SCATTERING[name]})
    backlit = Backlit(BoundingSphere((0.0, 0.0, 0.0), 1.0), 32, 20.0, 30.0)
    rng, lines = np.random.default_rng(0), 32
    rays = [backlit.lines(rng) for _ in range(lines)]
    origin, direction = (np.concatenate(column) for column in zip(*rays, strict=True))
    value = transmittance_samples(scene, origin, direction, 0).reshape(lines, 32, 32, 3)
    true = [backlit.transmitted(scene, 64, seed) for seed in range(4)]
    inside = np.hypot(*np.mgrid[-15.5:16, -15.5:16]) < 15
    told, seen = (np.array(p)[:, inside].mean((1, 2)) for p in (value, true))
    error = math.hypot(told.std() / math.sqrt(len(told)), seen.std() / math.sqrt(len(seen)))
    assert abs(told.mean() / seen.mean() - 1) < 0.02 + 3 * error / seen.mean()
    assert 0.1 < told.mean() < 0.95


def test_opaque_parts_and_masks(mitsuba: Any) -> None:
    """A mirror inside glass lets nothing through, a mask its opacity's rest, at both walls."""
    mirror = {"type": "sphere", "radius": 0.5, "bsdf": {"type": "conductor"}}
    mean, _ = through(mitsuba, {"glass": ball(1.0), "mirror": mirror}, 0.2)
    assert (mean == 0).all()
    mask = {"type": "mask", "opacity": 0.4, "nested": {"type": "diffuse"}}
    mean, error = through(mitsuba, {"mask": {"type": "sphere", "bsdf": mask}}, 0.2)
    assert (np.abs(mean - 0.36) < 4 * error).all()
