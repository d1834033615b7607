"""What the lamp looks like: three views through a lens, as it is and as it was learned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.measures import BoundingSphere
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Radiance
from purelight_train.truth.light_traced import light_traced, sharp_share
from purelight_train.truth.metrics import Comparison, Mask
from purelight_train.truth.picture import Picture, mean, means
from purelight_train.truth.thin_lens import ThinLens, aperture_for
from purelight_train.truth.views import field_view, three_views
from purelight_train.verdict.detail import Detail, Scale, detail, join

SIZE, SPP = 128, 16
BLOCK = 4  # errors are those of means over so many pixels squared: a few photons suffice
# Pixels: a sixtieth of the picture's width, or where noise hides that, a thirtieth
SCALES = (Scale(2, 8, eye=True), Scale(4, 16, eye=True))
KNOWN = 0.06  # standard error of what is kept from where on it is known
DARK = 0.1  # of the mean radiance of the lamp: what is dimmer is dark
# Of the mean radiance: a light wall (60 %) behind the lamp, eight radii away and lit by it, has so
# much, and what is much darker is as black beside it
WALL = 0.01


@dataclass(frozen=True)
class View:
    """The lamp through one lens: the truth, what the student shows, and where the lamp is."""

    lens: ThinLens
    truth: Picture
    student: Picture
    mask: Mask


def views(
    scene: mi.Scene,
    sphere: BoundingSphere,
    surface: ExitSurface,
    student: Radiance,
    paths: int,
    rounds: int,
    seed: int,
    progress: Callable[[int], None] = lambda _: None,
) -> list[View]:
    """From the side, from below and from above, in up to `rounds` times `paths` of light.

    Light is added until what is kept of the finest detail is known.
    """
    lenses = three_views(ThinLens(sphere, SIZE, 0, 0, aperture_for(sharp_share(scene))))
    fields = [
        field_view(surface, student, lens, SPP, np.random.default_rng([seed, k]))
        for k, lens in enumerate(lenses)
    ]
    traced: list[list[Picture]] = []
    for number in range(rounds):
        more = partial(_further, progress, number * paths)
        traced.append(light_traced(scene, lenses, paths, seed + number, more))
        truths = [mean(list(pictures)) for pictures in zip(*traced, strict=True)]
        made = [View(*v, *f) for v, f in zip(zip(lenses, truths, strict=True), fields, strict=True)]
        if Look(made).finest.error < KNOWN:
            break
    return made


def blocks_of(mask: Mask) -> Mask:
    """Blocks that are mostly lamp; of a lamp that is thinner, those with any of it.

    Arguments:
        mask: of pixels, [H, W].
    """
    part = means(mask, BLOCK)
    mostly: Mask = part > 0.5
    return mostly if mostly.any() else part > 0


def _further(progress: Callable[[int], None], before: int, done: int) -> None:
    progress(before + done)


@dataclass(frozen=True)
class Look:
    """Figures of all views together."""

    views: list[View]

    @cached_property
    def truth(self) -> Picture:
        return join([view.truth for view in self.views])

    @cached_property
    def student(self) -> Picture:
        return join([view.student for view in self.views])

    @cached_property
    def mask(self) -> Mask:
        return np.concatenate([view.mask for view in self.views])

    @property
    def finest(self) -> Detail:
        """What is left of the lamp's finest detail."""
        return self._detail(SCALES[0])

    @property
    def detail(self) -> tuple[float, Detail]:
        """What is left of the finest detail that is known, and its part of the picture's width.

        Detail that is too faint to be seen counts only where no scale has any other.
        """
        every = [(scale.side / SIZE, self._detail(scale)) for scale in SCALES]
        seen = [pair for pair in every if not pair[1].faint] or every
        return next((pair for pair in seen if pair[1].error < KNOWN), seen[-1])

    def _detail(self, scale: Scale) -> Detail:
        return detail(self.student, self.truth, scale, self.mask)

    @property
    def error(self) -> tuple[float, float]:
        """Mean absolute difference over the mean radiance, noise taken out; and the noise."""
        told, true, mask = self._blocks
        both = Comparison(told, true, mask)
        return both.absolute_over_mean(), both.absolute_noise()

    @property
    def haze(self) -> float:
        """How much too bright the lamp's dark parts are, relative; 0 if nothing is dark.

        Relative to the light that they and the wall behind the lamp (`WALL`) have. What is dark one
        half of the truth says, and how dark it is the other, so that what looked dark by chance
        does not count.
        """
        told, true, mask = self._blocks
        level = float((true.image @ LUMINANCE)[mask].mean()) if mask.any() else 0.0
        more, light = 0.0, 0.0
        for one, other in (true.halves, true.halves[::-1]):
            dark = mask & (one @ LUMINANCE < DARK * level)
            more += float(((told.image - other) @ LUMINANCE)[dark].sum())
            light += float((other @ LUMINANCE + WALL * level)[dark].sum())
        return more / light if light > 0 else 0.0

    @cached_property
    def _blocks(self) -> tuple[Picture, Picture, Mask]:
        mask = blocks_of(self.mask)
        return self.student.blocks(BLOCK), self.truth.blocks(BLOCK), mask
