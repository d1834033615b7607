"""Bias and noise of the photon map against its neighbours, on a lamp of known exitance.

A point light near the wall of a black-box globe (an absorbing ball of no optical depth: its surface
passes light straight) gives the globe the exitance I cos(theta) / d² per channel, from 0.14 to 25
times its mean. The map's error has two parts: noise, which falls as 1 / sqrt(k), and bias, which
grows with the disc's area and so with k / N. `python -m benchmarks.photon_map_radius` prints both
for several numbers of photons N and neighbours k.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format import command
from purelight_mitsuba import platform
from purelight_train.light.exit_records import ExitRecords, settle
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.light_tracing import trace_records
from purelight_train.light.luminaire import scene_triangles
from purelight_train.light.positional_density import PositionalDensity
from purelight_train.light.visible_part import visible_part

RADIUS, OFFSET, INTENSITY = 0.05, 0.03, 1.0
NEIGHBOURS = (50, 100, 200, 400, 800, 1600, 3200, 6400)
MILLIONS = (1, 4)
QUERIES = 20_000


def exitance(position: NDArray[np.float32]) -> NDArray[np.float64]:
    """Power per area on the globe in W/m²: [M, 3] -> [M]."""
    outward = position.astype(np.float64) / RADIUS
    toward = position - np.array([0.0, 0.0, OFFSET])
    distance = np.linalg.norm(toward, axis=1)
    cosine = np.einsum("nd,nd->n", outward, toward) / distance
    return INTENSITY * cosine / distance**2


def globe() -> Any:
    """The lamp's scene."""
    import mitsuba as mi

    point = {"type": "point", "position": [0, 0, OFFSET], "intensity": INTENSITY}
    ball = {"type": "sphere", "radius": RADIUS, "bsdf": {"type": "null"}}
    return mi.load_dict({"type": "scene", "point": point, "ball": ball})


def measure(
    records: ExitRecords, surface: ExitSurface, neighbours: int, rng: np.random.Generator
) -> tuple[float, float]:
    """Root mean square relative error, and its smooth part, both weighted by power.

    Two independent halves of the photons share the bias but not the noise: the mean product of
    their errors is the square of the bias.
    """
    halves = [records.take(slice(i, None, 2)) for i in range(2)]
    position, normal = surface.sample(QUERIES, rng)
    true = exitance(position)
    errors = []
    for half in halves:
        # A half has half of the power: count half of the paths
        density = PositionalDensity.build(half, surface, neighbours, rng)
        errors.append(2 * density.exitance(position, normal)[:, 0] / true - 1)
    weight = true / true.sum()
    square = float(weight @ (0.5 * (errors[0] ** 2 + errors[1] ** 2)))
    return math.sqrt(square), math.sqrt(max(float(weight @ (errors[0] * errors[1])), 0.0))


def main() -> int:
    """Print the table."""
    command.Parser(prog="python -m benchmarks.photon_map_radius", description=__doc__).parse_args()
    platform.use()
    scene = globe()
    surface = visible_part(*scene_triangles(scene), 1 << 18, np.random.default_rng(0))
    print("| photons | neighbours | radius / lamp radius | error | bias | noise |")
    print("|---|---|---|---|---|---|")
    for millions in MILLIONS:
        traced = settle(trace_records(scene, 2 * millions << 20, 0), surface)[0]
        count = len(traced) // 2
        for neighbours in NEIGHBOURS:
            error, bias = measure(traced, surface, neighbours, np.random.default_rng(1))
            radius = math.sqrt(neighbours * surface.area / (math.pi * count)) / RADIUS
            noise = math.sqrt(max(error**2 - bias**2, 0))
            print(f"| {millions} M | {neighbours} | {radius:.4f} | {100 * error:.2f}% | "
                  f"{100 * bias:.2f}% | {100 * noise:.2f}% |", flush=True)  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.photon_map_radius", main))
