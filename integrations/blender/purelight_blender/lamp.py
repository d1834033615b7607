"""A lamp as Blender needs it, made of a bundle in memory: nothing of Blender is touched here."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np

from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.members import PHOTOMETRY
from purelight_format.validation.validate import validate
from purelight_shader.targets import osl
from purelight_shader.translation import translate

from . import convexity, sides
from .flux_bins import Bins, bins

PREFIX = "purelight"
NETWORKS = ("appearance", "transparency")
MET = "    int first = !backfacing();"  # A closed convex lamp is met from outside, once.
AHEAD = """\
    // Whether the ray has met this lamp before: is any of it between here and the viewer?
    vector along = vector(o);
    vector from = vector(p) - vector({x:.9g}, {y:.9g}, {z:.9g});
    float b = dot(from, along);
    float chord = -b + sqrt(max(0.0, b * b - dot(from, from) + {r2:.9g}));
    float unit = length(transform("object", "common", along));
    float walked = 1e30;
    getattribute("path:ray_length", walked);
    float least = {least:.9g} * unit;
    float most = min(chord * unit, walked * 0.9999) - least;
    int first = most <= least || !trace(P + least * normalize(I), normalize(I), "maxdist", most);"""
THROUGH = """\
        float passed[3];
        ${prefix}_transmittance(Tables, place, side, leaving, passed);
        Transmittance = color(passed[0], passed[1], passed[2]);"""


@dataclass(frozen=True)
class Lamp:
    """What is put into a scene.

    Arguments:
        name: of the lamp.
        digest: of the bundle.
        sphere: around it, in metres.
        flux: W per channel.
        positions: [V, 3] metres.
        triangles: [T, 3].
        bins: of the triangles.
        look: [V, 3] mean radiance about each corner in W/(m² sr), the same from all sides.
        clear: [3] mean transmittance; zeros for an opaque lamp.
        opaque: whether there is no transmittance.
        shader: text in OSL.
        texels: [rows, width, 4] float32 that it reads, or None.
        photometry: IES text, or empty.
        warnings: of the validator, one line each.
    """

    name: str
    digest: str
    sphere: BoundingSphere
    flux: np.ndarray
    positions: np.ndarray
    triangles: np.ndarray
    bins: Bins
    look: np.ndarray
    clear: np.ndarray
    opaque: bool
    shader: str
    texels: np.ndarray | None
    photometry: bytes
    warnings: tuple[str, ...]


def read(path: str | Path) -> Lamp:
    """Reads and checks a bundle, its golden vectors included.

    Raises:
        PureLightError: With one line, if it is not valid or its networks cannot be written in OSL.
    """
    path = Path(path)
    report = validate(path)
    if report.errors:
        first = report.errors[0]
        raise PureLightError(f"{path.name}: {first.code.name} at {first.location}: {first.message}")
    bundle = Bundle.open(path)
    warnings = tuple(f"{w.code.name} at {w.location}: {w.message}" for w in report.issues)
    return of(bundle, warnings)


def of(bundle: Bundle, warnings: tuple[str, ...] = ()) -> Lamp:
    """A valid bundle as a lamp for Blender.

    Raises:
        PureLightError: If its networks cannot be written in OSL.
    """
    about = bundle.manifest
    surface = bundle.surface()
    positions, triangles, flux = _welded(
        surface.positions, surface.triangles, surface.triangle_flux
    )
    turned = convexity.outward(positions, triangles)
    triangles, both = (
        sides.open_sides(positions, triangles)
        if turned is None
        else (turned, np.zeros(len(turned), bool))
    )
    area = _area(positions, triangles)
    store = osl.store()
    translation = translate(bundle, store, NETWORKS)
    functions, elements = osl.functions(translation, PREFIX)
    _require_room(elements, functions)
    opaque = "transparency" not in about.networks
    head = f"// A PureLight luminaire, made from the bundle\n// {bundle.digest}"
    seen = MET if turned is not None else _ahead(about.bounding_sphere)
    through = "" if opaque else Template(THROUGH).substitute(prefix=PREFIX)
    page = resources.files(__package__).joinpath("lamp.osl.in").read_text("utf-8")
    shader = Template(page).substitute(
        head=head, functions=functions, prefix=PREFIX, first=seen, transmittance=through,
        else_clear="0" if opaque else "1",
    )  # fmt: skip
    photometry = bundle.read(PHOTOMETRY) if PHOTOMETRY in bundle.entries else b""
    return Lamp(
        about.name, bundle.digest, about.bounding_sphere, np.array(about.flux, np.float64),
        positions, triangles, bins(area, flux, both), _look(positions, triangles, area, flux),
        np.zeros(3) if opaque else _clear(bundle), opaque, shader, osl.texels(store), photometry,
        warnings,
    )  # fmt: skip


def _require_room(elements: int, text: str) -> None:
    from purelight_shader.output.targets import ELEMENTS, LONGEST

    if elements > ELEMENTS or len(text) > LONGEST:
        raise PureLightError(
            "the lamp's networks are too large for OSL; train a smaller lamp (purelight-size)"
        )


def _ahead(sphere: BoundingSphere) -> str:
    x, y, z = map(float, sphere.center)
    radius = float(sphere.radius)
    return AHEAD.format(x=x, y=y, z=z, r2=(1.001 * radius) ** 2, least=2e-5 * radius)


def _welded(
    positions: np.ndarray, triangles: np.ndarray, flux: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equal corners as one; no triangle without area, and none twice: one with the flux of both."""
    placed, index = np.unique(positions + np.float32(0), axis=0, return_inverse=True)
    joined = index.reshape(-1)[triangles.astype(np.int64)]
    sets, first, owner = np.unique(
        np.sort(joined, 1), axis=0, return_index=True, return_inverse=True
    )
    total = np.zeros((len(sets), 3))
    np.add.at(total, owner.reshape(-1), flux.astype(np.float64))
    kept = joined[first]
    real = _area(placed, kept) > 0
    if not real.any():
        raise PureLightError("the exit surface has no area")
    return placed, kept[real], total[real]


def _area(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(positions.astype(np.float64)[triangles], 1, 0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def _look(
    positions: np.ndarray, triangles: np.ndarray, area: np.ndarray, flux: np.ndarray
) -> np.ndarray:
    """Flux about each corner over π times the area there: [V, 3]."""
    count = len(positions)
    corners, three = triangles.ravel(), np.repeat(flux, 3, 0)
    power = np.stack([np.bincount(corners, three[:, k], count) for k in range(3)], 1)
    covered = np.bincount(corners, np.repeat(area, 3), count)
    return np.asarray(power / np.maximum(np.pi * covered, 1e-300)[:, None])


def _clear(bundle: Bundle) -> np.ndarray:
    """Mean transmittance of the golden rays, which are drawn all over the lamp: [3]."""
    vectors = bundle.vectors("transparency")
    return np.asarray(vectors.outputs["transmittance"], np.float64).mean(0)


def luminous(flux: np.ndarray) -> float:
    """Luminance-weighted W of a flux [3]."""
    return float(flux @ LUMINANCE)
