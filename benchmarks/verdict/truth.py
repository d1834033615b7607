"""What a verdict foretells, measured another way: at other places, on other light, rendered.

A verdict asks the networks on spheres around the lamp. Here the exported bundle is rendered by the
Mitsuba runtime on a floor, a wall and a ceiling, and looked at from three other sides.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.verdict.figures import Look as LookFigures
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.light_tracing import trace_records
from purelight_train.truth.light_traced import light_traced, sharp_share
from purelight_train.truth.picture import Passes, Picture
from purelight_train.truth.plane import Plane, plane_irradiance
from purelight_train.truth.thin_lens import ThinLens, aperture_for
from purelight_train.truth.views import field_view
from purelight_train.verdict import light
from purelight_train.verdict.look import SIZE, SPP, Look, View
from purelight_train.verdict.measure import looked_figures
from tests.support.fidelity import Subject, floor_irradiance

# Degrees about x that turn what is below, beside and above a lamp to where the floor is
TURNS = {"floor": 0.0, "wall": 90.0, "ceiling": 180.0}
DISTANCE, SIDE = 3.0, 6.0  # of each from the centre, and its edge, in radii
CELLS = 9  # along each edge: each sees as much of the sphere as a place of the verdict, 9 degrees
SIDES = ((-20.0, -15.0), (100.0, 25.0), (-140.0, 60.0))  # azimuth, elevation
PASSES = 4
SEEDS = (9_000_001, 9_500_009)


@dataclass(frozen=True)
class Effort:
    """How much light: paths of the planes and of the pictures, samples a cell of a rendering."""

    planes: int = 1 << 23
    pictures: int = 1 << 23
    spp: int = 1 << 10


def found(subject: Subject, effort: Effort) -> dict[str, Any]:
    """Errors of both modes on the planes, and the figures of the pictures."""
    plane = _plane(subject)
    true = _traced(subject, plane, effort.planes)
    result: dict[str, Any] = {}
    for mode in ("accurate", "fast"):
        if mode == "fast" and not subject.luminaire.has("fast_map"):
            continue
        told = _rendered(subject, plane, mode, effort.spp)
        result[mode] = vars(light.error(told, true))
    return result | {"look": _look(subject, effort.pictures)}


def _plane(subject: Subject) -> Plane:
    sphere = subject.description.sphere
    x, y, z = sphere.center
    return Plane((x, y, z - DISTANCE * sphere.radius), SIDE * sphere.radius, CELLS)


def _turn(degrees: float) -> NDArray[np.float64]:
    """Rotation about x: [3, 3]."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _turned(records: ExitRecords, centre: NDArray[np.float64], degrees: float) -> ExitRecords:
    """Records of the lamp turned about its centre."""
    turn = _turn(degrees)
    position = ((records.position - centre) @ turn.T + centre).astype(np.float32)
    direction = (records.direction @ turn.T).astype(np.float32)
    return dataclasses.replace(records, position=position, direction=direction)


def _traced(subject: Subject, plane: Plane, paths: int) -> Picture:
    """Traced irradiance on all planes, one under the other."""
    centre, sums = np.asarray(subject.description.sphere.center), Passes()
    for batch in range(2 * -(-paths // (2 << 20))):
        records = trace_records(subject.lamp, 1, SEEDS[0] + batch)
        out = records.take(records.escaped)
        parts = [plane_irradiance(_turned(out, centre, t), plane)[0] for t in TURNS.values()]
        sums.add(np.concatenate(parts))
    return sums.picture()


def _rendered(subject: Subject, plane: Plane, mode: str, spp: int) -> Picture:
    """The same of the bundle, as the runtime renders it."""
    centre = list(subject.description.sphere.center)
    integrator = {"type": "purelight", "mode": mode, "max_depth": 2}
    sums = Passes()
    for seed in range(PASSES):
        parts = []
        for degrees in TURNS.values():
            place = mi.ScalarTransform4f().translate(centre).rotate([1, 0, 0], degrees)
            lamp = {
                "type": "purelight", "filename": str(subject.bundle.resolve()),
                "to_world": place.translate([-x for x in centre]),
            }  # fmt: skip
            parts.append(
                floor_irradiance({"lamp": lamp}, integrator, plane, spp // PASSES, seed + 1)
            )
        sums.add(np.concatenate(parts))
    return sums.picture()


def _look(subject: Subject, paths: int) -> dict[str, float] | None:
    """Figures of other views, with light of their own."""
    found = looked_figures(Look(list(_views(subject, paths))))
    return None if found is None else _named(found)


def _named(figures: LookFigures) -> dict[str, float]:
    return dict(vars(figures))


def _views(subject: Subject, paths: int) -> Iterator[View]:
    aperture = aperture_for(sharp_share(subject.lamp))
    lens = ThinLens(subject.description.sphere, SIZE, 0, 0, aperture)
    lenses = [dataclasses.replace(lens, azimuth=a, elevation=e) for a, e in SIDES]
    truths = light_traced(subject.lamp, lenses, paths, SEEDS[1])
    for k, (lens, truth) in enumerate(zip(lenses, truths, strict=True)):
        student, mask = field_view(
            subject.surface, subject.radiance, lens, SPP, np.random.default_rng([k, 5])
        )
        yield View(lens, truth, student, mask)
