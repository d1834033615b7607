"""A verdict's figures, from light that nothing was trained on."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import mitsuba as mi
import numpy as np

from purelight_format.measures import BoundingSphere
from purelight_format.verdict import figures
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.light_tracing import BATCH, trace_records
from purelight_train.light.radiance_field import Radiance
from purelight_train.truth.picture import Image, Passes, Picture
from purelight_train.verdict import arriving, light
from purelight_train.verdict.detail import Detail, Scale, detail
from purelight_train.verdict.look import Look, View, views
from purelight_train.verdict.near import Near
from purelight_train.verdict.shells import Shells

GOAL = 0.03  # noise of a place that ends the tracing early
PLACE = 2  # cells a side of a place, nine degrees: what a room's light is judged by
PATTERN = Scale(1, 4)
HEIGHT = 0.5  # cosine with the vertical from which on a place is below, or above
USUAL = 3 << 19  # paths of the preset `draft`, for which the numbers below are
LIGHT, STUDENT = 8, 16  # batches of light, passes of the student's rays
LOOK, ROUNDS = 1 << 22, 3  # paths of the pictures, and how often at most
SEEDS = (300_007, 500_009)  # of light and of pictures, besides the run's


@dataclass(frozen=True)
class Learned:
    """What a lamp's networks say.

    Arguments:
        references: to draw rays from.
        student: radiance.
        sample: directions towards the lamp, of the sampler.
        fast_map: None if there is none.
    """

    references: ReferenceRays
    student: Radiance
    sample: arriving.Sample
    fast_map: arriving.Map | None = None


@dataclass
class Judge:
    """Measures one lamp; each part once, when it is first asked for.

    Arguments:
        scene: that holds only the lamp.
        paths: of the run's preset: smaller runs are judged on less light.
        progress: called with the paths done so far, of `total`.
    """

    scene: mi.Scene
    sphere: BoundingSphere
    learned: Learned
    paths: int
    seed: int
    progress: Callable[[int], None] = lambda _: None

    @property
    def surface(self) -> ExitSurface:
        return self.learned.references.chart.surface

    @property
    def _effort(self) -> float:
        return min(self.paths / USUAL, 1.0)

    def _even(self, most: int) -> int:
        """An even number of passes, fewer for smaller runs."""
        return max(2, 2 * round(most * self._effort / 2))

    @property
    def total(self) -> int:
        """Paths traced at most."""
        return self._even(LIGHT) * BATCH + ROUNDS * self._look_paths

    @property
    def _look_paths(self) -> int:
        return int(LOOK * self._effort)

    # Pictures

    @cached_property
    def views(self) -> list[View]:
        """The lamp and the student through lenses."""
        return views(
            self.scene, self.sphere, self.surface, self.learned.student, self._look_paths,
            ROUNDS, self.seed + SEEDS[1], self.progress,
        )  # fmt: skip

    # Light

    def verdict(self, by_heart: float | None = None) -> figures.Verdict:
        """All figures; `by_heart` is the run's to know."""
        near, rng = Near.of(self.surface, self._rng(0)), self._rng(1)
        looked = Look(self.views)  # first, so that the progress goes on from there
        true, true_near, paths = self._traced(near)
        student = arriving.of_student(
            self._shells, self.learned.references, self.learned.student, self._even(STUDENT), rng
        )
        fast = self.learned.fast_map
        return figures.Verdict(
            photons=paths,
            accurate=self._mode(student, true),
            fast=None
            if fast is None
            else self._mode(arriving.of_map(self._shells, fast, rng), true),
            share=figures.Zones(*(self._shares(true.image))),
            pattern=self._pattern(true, true).contrast,
            near=None if near is None else _places(near, self.learned.student, true_near, rng),
            look=looked_figures(looked),
            grain=arriving.grain(
                self._shells, true, self.surface, self.learned.student, self.learned.sample, rng
            ),
            by_heart=by_heart,
        )

    def _rng(self, part: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, part, 1789])

    @property
    def _shells(self) -> Shells:
        return Shells(self.sphere)

    def _batches(self) -> Iterator[ExitRecords]:
        """Fresh light, and what there is between the lamp's parts."""
        for batch in range(self._even(LIGHT)):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # it was said when the lamp was first traced
                seed = self.seed + SEEDS[0] + batch
                yield trace_records(self.scene, BATCH, seed, surface=self.surface)

    def _traced(self, near: Near | None) -> tuple[Picture, Picture, int]:
        """Light on the shells and at the places inside, and the paths that it took."""
        shells, inside, paths = Passes(), Passes(), 0
        for records in self._batches():
            out = records.take(records.escaped)
            shells.add(self._shells.caught(out.position, out.direction, out.weight) / out.paths)
            inside.add(np.zeros((1, 1, 3)) if near is None else near.caught(records))
            paths += records.paths
            self.progress(ROUNDS * self._look_paths + paths)
            if shells.count % 2 == 0 and light.noise_of(shells.picture()) < GOAL:
                break
        return shells.picture(), inside.picture(), paths

    def _mode(self, told: Picture, true: Picture) -> figures.Mode:
        found = light.error(told.blocks(PLACE), true.blocks(PLACE))
        zones = [light.ratio(told.image[z], true.image[z]) for z in self._zones]
        kept = self._pattern(told, true).kept
        return figures.Mode(**vars(found), pattern=kept, zones=figures.Zones(*zones))

    def _pattern(self, told: Picture, true: Picture) -> Detail:
        return detail(told, true, PATTERN, np.ones(true.image.shape[:2], bool))

    @cached_property
    def _zones(self) -> list[np.ndarray]:
        """Which cells are below, around and above the lamp."""
        height = self._shells.height()[..., 0]
        return [height < -HEIGHT, np.abs(height) <= HEIGHT, height > HEIGHT]

    def _shares(self, image: Image) -> list[float]:
        return [float(image[zone].sum() / image.sum()) for zone in self._zones]


def _places(
    near: Near, radiance: Radiance, true: Picture, rng: np.random.Generator
) -> figures.Places | None:
    """Errors at places inside; None if no light was found there."""
    if not true.image.any():
        return None
    return figures.Places(**vars(light.error(near.of_student(radiance, rng), true)))


def looked_figures(looked: Look) -> figures.Look | None:
    """Figures of the pictures; None of a lamp that no view meets, or that is dark in them all."""
    if not looked.mask.any() or not looked.truth.image[looked.mask].any():
        return None
    (size, kept), (error, noise) = looked.detail, looked.error
    return figures.Look(size, kept.kept, min(kept.error, 1.0), looked.haze, error, noise)
