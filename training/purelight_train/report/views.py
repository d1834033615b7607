"""Rows of the report: the lamp through a lens, as it is and as it was learned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Radiance
from purelight_train.report.difference import shown, shown_scale
from purelight_train.report.grading import Grade, lamp_grade
from purelight_train.report.page import Row, Shot
from purelight_train.truth.metrics import Comparison, Mask
from purelight_train.truth.picture import Image, Picture
from purelight_train.truth.views import field_view
from purelight_train.verdict.light import ratio
from purelight_train.verdict.look import BLOCK, View, blocks_of

DARK = 0.01  # of the mean of all views: a view that has less is of the lamp's dark side
TEACHER_SPP = 2  # a teacher is slow to ask
TITLES = ("From the side", "From below", "From above")


@dataclass(frozen=True)
class LampViews:
    """Views of a lamp: reference, teacher, student, and how the student differs.

    Arguments:
        views: with their references and the student.
        teacher: learned radiance; a run may have none.
    """

    description: Description
    surface: ExitSurface
    views: Sequence[View]
    teacher: Radiance | None = None

    def rows(self) -> list[Row]:
        """The rows, one a view, all at the same exposure.

        None of views in which the lamp is too thin to be met by any ray of the picture.
        """
        views = [pair for pair in zip(TITLES, self.views, strict=True) if pair[1].mask.any()]
        if not views:
            return []
        lit = np.concatenate([view.truth.image[view.mask] for _, view in views])
        grade = lamp_grade(self.description.flux, lit, 93)
        level = float(lit.mean())
        return [
            self._row(grade, level, *pair, told=number == 0) for number, pair in enumerate(views)
        ]

    def _row(self, grade: Grade, level: float, title: str, view: View, *, told: bool) -> Row:
        mask = blocks_of(view.mask)
        fields = {"Student": view.student}
        if self.teacher is not None:
            rng = np.random.default_rng(4)
            taught, _ = field_view(self.surface, self.teacher, view.lens, TEACHER_SPP, rng)
            fields = {"Teacher": taught, "Student": view.student}
        dark = not float(view.truth.image[view.mask].mean()) > DARK * level
        shots = [_truth_shot(grade, view.truth, mask, dark=dark)]
        for name, picture in fields.items():
            figures = _stray(picture, mask, level) if dark else _errors(picture, view.truth, mask)
            shots.append(Shot(name, grade.uri(picture.image), figures))
        shots += _differences(grade, view)
        text = (
            f"Through a lens of {100 * view.lens.aperture:.0f} % of its distance, every picture "
            "at the same exposure. The reference is light traced out of the lamp. Errors are over "
            f"the picture's mean radiance, of means over {BLOCK}x{BLOCK} pixels; noise is judged "
            "from two halves of each picture. The map of differences shows by how much the student "
            "is too bright (warm) or too dark (blue) as shown here, in parts of white; the last "
            "picture shows how much of that is the reference's noise, on the same scale."
        )
        return Row(title, text if told else "", shots)


def _truth_shot(grade: Grade, truth: Picture, mask: Mask, *, dark: bool) -> Shot:
    if dark:
        return Shot("Reference", grade.uri(truth.image), {"dark from here": ""})
    noise = Comparison(truth.blocks(BLOCK), truth.blocks(BLOCK), mask).absolute_noise()
    return Shot("Reference", grade.uri(truth.image), {"own noise": f"{100 * noise:.1f} %"})


def _stray(picture: Picture, mask: Mask, level: float) -> dict[str, str]:
    """What is seen where next to nothing should be, which no error can be relative to."""
    seen = float(picture.blocks(BLOCK).image[mask].mean()) / max(level, 1e-300)
    return {"brightness, of all views' mean": f"{100 * seen:.1f} %"}


def _errors(picture: Picture, truth: Picture, mask: Mask) -> dict[str, str]:
    both = Comparison(picture.blocks(BLOCK), truth.blocks(BLOCK), mask)
    return {
        "error, noise taken out": f"{100 * both.absolute_over_mean():.1f} %",
        "brightness": f"{100 * ratio(both.picture.image[mask], both.reference.image[mask]):+.1f} %",
    }


def _differences(grade: Grade, view: View) -> list[Shot]:
    """How far the student is from the reference as shown, and the reference from itself."""
    student, truth = view.student.blocks(BLOCK).image, view.truth.blocks(BLOCK)
    # The mean of half the light is as far from that of all as that is from the truth
    maps = {"Difference": (student, truth.image), "Noise in it": (truth.halves[0], truth.image)}
    apart = {title: grade.shown(a) - grade.shown(b) for title, (a, b) in maps.items()}
    scale = shown_scale(apart["Difference"])
    return [_map(title, each, view.mask, scale) for title, each in apart.items()]


def _map(title: str, apart: Image, mask: Mask, scale: float) -> Shot:
    large = np.kron(apart, np.ones((BLOCK, BLOCK)))
    figures = {"mean over the lamp": f"{100 * np.abs(large[mask]).mean():.1f} % of white"}
    return Shot(title, shown(large, scale), figures, f"{100 * scale:.0f} % of white")
