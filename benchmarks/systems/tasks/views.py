"""Appearance: the lamp itself before black, through a thin lens focused on its centre."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.protocol import Image, Subject
from benchmarks.systems.tasks import placing
from benchmarks.systems.tasks.task import SEED, Figures, JudgedTask, ready
from benchmarks.systems.tasks.truth import Mask, Truth
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere
from purelight_mitsuba.scene_file import load_scene
from purelight_train.truth.picture import Picture

FINE = 2  # pixels: what is lost by a mean over so many to each side is fine detail
COVER = 16  # rays a pixel that say whether it sees the lamp
MARGIN = 1.05  # of a picture over the lamp's sphere, as in `truth.thin_lens`


@dataclass(frozen=True)
class View(JudgedTask):
    """A view of the lamp; its truth is light traced by our own tracer, at the lamp's own size.

    Arguments:
        azimuth, elevation: of the lens as seen from the lamp, in degrees.
        size: pixels a side.
        aperture: radius of the lens over its distance, see `truth.thin_lens.aperture_for`.
        distance: in radii.
    """

    name: str
    azimuth: float
    elevation: float
    size: int
    aperture: float
    distance: float = 4.0
    kind: str = "appearance"

    def camera(self, sphere: BoundingSphere) -> Camera:
        """The lens about a sphere."""
        return Camera.orbit(
            sphere, azimuth=self.azimuth, elevation=self.elevation, distance=self.distance,
            size=self.size, lens=self.aperture * self.distance, margin=MARGIN,
        )  # fmt: skip

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """The lamp alone."""
        camera = self.camera(placing.sphere(subject, lamp))
        sensor = placing.lens(camera, math.degrees(2 * math.atan(camera.half_width)))
        lamps = placing.elements(subject, lamp, folder)
        return placing.write(folder, self.name, lamp, sensor, [], lamps)

    def truth(self, subject: Subject, folder: Path, paths: int) -> Truth:
        """Every photon that leaves the lamp, joined to the lens or caught by it."""
        return self.truths([], subject, folder, paths)[self.name]

    def truths(
        self, tasks: Sequence[JudgedTask], subject: Subject, folder: Path, paths: int
    ) -> dict[str, Truth]:
        """All views among `tasks` share the photons and, in equal parts, the seconds."""
        ready(subject.threads)
        from purelight_train.truth.light_traced import light_traced

        start, lamp = time.perf_counter(), load_scene(subject.scene)
        views = [self, *(t for t in tasks if isinstance(t, View) and t != self)]
        lenses = [view._thin_lens(subject) for view in views]
        pictures = light_traced(lamp, lenses, paths, SEED)
        masks = [v._silhouette(lamp, lens) for v, lens in zip(views, lenses, strict=True)]
        seconds = (time.perf_counter() - start) / len(views)
        return {
            view.name: Truth(picture, mask, paths, seconds)
            for view, picture, mask in zip(views, pictures, masks, strict=True)
        }

    def _thin_lens(self, subject: Subject) -> Any:
        from purelight_train.truth.thin_lens import ThinLens

        sphere = BoundingSphere(subject.centre, subject.radius)
        return ThinLens(
            sphere, self.size, self.azimuth, self.elevation, self.aperture, self.distance
        )

    def _silhouette(self, lamp: Any, lens: Any) -> Mask:
        """Where at least half of a pixel's rays meet the lamp."""
        import mitsuba as mi

        rng, met = np.random.default_rng(0), np.zeros(self.size**2)
        for _ in range(COVER):
            origin, direction = (np.ascontiguousarray(v.T) for v in lens.rays(rng))
            ray = mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction))
            met += np.array(lamp.ray_test(ray))
        return (2 * met >= COVER).reshape(self.size, self.size)

    def figures(self, subject: Subject, picture: Picture, truth: Truth) -> Figures:
        """`sharpness`: see `sharpness`."""
        return {"sharpness": sharpness(picture.image, truth)}


def sharpness(image: Image, truth: Truth) -> float | None:
    r"""What part of the truth's fine detail a picture shows: 1 all, 0 none, None if there is none.

    Detail H is a picture less its mean over 5 x 5 pixels; this is the slope of the picture's detail
    over the truth's, :math:`\sum H(I) H(R) / \sum H(R_a) H(R_b)`. R is independent of I, and so are
    the truth's halves of each other: noise adds to neither sum but by chance.
    """
    true, (a, b) = truth.picture.image, truth.picture.halves
    detail = [_detail(x)[truth.mask] for x in (image, true, a, b)]
    power = float((detail[2] * detail[3]).sum())
    return float((detail[0] * detail[1]).sum()) / power if power > 0 else None


def _detail(image: Image) -> NDArray[np.float64]:
    side = 2 * FINE + 1
    padded = np.pad(image, ((FINE, FINE), (FINE, FINE), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side, side), (0, 1))
    result: NDArray[np.float64] = image - windows.mean((-2, -1))
    return result
