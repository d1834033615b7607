"""Light that arrives on spheres around a lamp: of the student, of the fast map, and its grain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.measures import MAP_SIDE, cap, cap_to_direction, light_estimate
from purelight_train.learning.flux_closure import PASS, escaping_rays
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Float, Radiance, look
from purelight_train.truth.picture import Image, Passes, Picture
from purelight_train.verdict.shells import Shells, as_picture

POINT_PASSES = 4  # of the fast map
CELL_SAMPLES = 4  # of a map's cell, a side
POINTS, DRAWS = 64, 256  # to judge the grain by
Map = Callable[[Float], Float]  # [N, 3] -> [N, 16, 16, 3]
Sample = Callable[[Float, Float], tuple[Float, Float]]  # point, u -> toward, pdf_solid_angle


def of_student(
    shells: Shells,
    references: ReferenceRays,
    radiance: Radiance,
    passes: int,
    rng: np.random.Generator,
) -> Picture:
    """A radiance field's light on the shells in W, by rays that leave the lamp."""
    sums = Passes()
    for _ in range(passes):
        position, outgoing, power = escaping_rays(references, radiance, PASS, rng)
        sums.add(shells.caught(position, outgoing, power) / PASS)
    return sums.picture()


def of_map(shells: Shells, fast_map: Map, rng: np.random.Generator) -> Picture:
    """A fast map's light on the shells in W: irradiance at random points of the cells."""
    sums, weights = Passes(), [_projected(shells, radius) for radius in shells.radii]
    for _ in range(POINT_PASSES):
        parts = zip(shells.points(rng), weights, shells.cell_areas, strict=True)
        power = [
            area * np.einsum("nkc,k->nc", fast_map(point).reshape(len(point), -1, 3), weight)
            for point, weight, area in parts
        ]
        sums.add(as_picture(np.stack(power)))
    return sums.picture()


def _projected(shells: Shells, radius: float) -> Image:
    """Projected solid angle of each cell of a map at a distance in radii: [256] in sr.

    The surface faces the lamp's centre, so it depends on the place in the square alone.
    """
    side = MAP_SIDE * CELL_SAMPLES
    row, column = np.mgrid[0:side, 0:side].reshape(2, -1)
    square = (np.stack((column, row), -1) + 0.5) / side
    away = np.array([[0.0, 0.0, radius * shells.sphere.radius]])
    seen = cap(np.repeat(np.asarray(shells.sphere.center) + away, len(square), 0), shells.sphere)
    cosine = np.einsum("nd,nd->n", cap_to_direction(square, seen), seen.axis)
    blocks = cosine.reshape(MAP_SIDE, CELL_SAMPLES, MAP_SIDE, CELL_SAMPLES).mean((1, 3))
    result: Image = blocks.ravel() * seen.solid_angle[0] / MAP_SIDE**2
    return result


def grain(
    shells: Shells,
    light: Picture,
    surface: ExitSurface,
    radiance: Radiance,
    sample: Sample,
    rng: np.random.Generator,
) -> float:
    """Relative variance of one shadow ray of accurate mode, at places drawn by their light.

    Arguments:
        light: on the shells.
        sample: draws directions towards the lamp.
    """
    power = np.maximum(light.image.sum(-1), 0).ravel()
    chosen = rng.choice(len(power), POINTS, p=power / power.sum())
    point = np.repeat(shells.points(rng).reshape(-1, 3)[chosen], DRAWS, 0)
    toward, pdf = sample(point, rng.random((len(point), 2)).astype(np.float32))
    seen = look(surface, radiance, point, toward)
    axis = cap(point.astype(np.float64), shells.sphere).axis
    cosine = np.einsum("nd,nd->n", toward, axis)
    value = (light_estimate(seen, cosine, pdf) @ LUMINANCE).reshape(POINTS, DRAWS)
    lit = value.mean(1) > 0
    return float(np.mean(value[lit].var(1) / value[lit].mean(1) ** 2)) if lit.any() else 0.0
