"""Rows of the report: the lamp through a lens, as it is and as it was learned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Radiance
from purelight_train.report.grading import Grade, heat, lamp_grade
from purelight_train.report.page import Row, Shot
from purelight_train.truth.light_traced import light_traced, sharp_share
from purelight_train.truth.metrics import Comparison, Mask
from purelight_train.truth.picture import Picture, means
from purelight_train.truth.thin_lens import ThinLens, aperture_for
from purelight_train.truth.views import field_view, three_views

SIZE, SPP = 128, 4
TEACHER_SPP = 2  # a teacher is slow to ask
VIEWS = ("From the side", "From below", "From above")
BLOCK = 4  # errors are those of means over so many pixels squared: a few photons suffice
HEAT_WHITE = 0.5


@dataclass(frozen=True)
class LampViews:
    """Three views of a lamp: reference, teacher, student, and the student's error.

    Arguments:
        scene: the lamp as a Mitsuba scene.
        student, teacher: learned radiance; a run may have no teacher.
        paths: light paths to trace for the reference.
        progress: called with the paths done so far.
    """

    description: Description
    scene: Any
    surface: ExitSurface
    student: Radiance
    teacher: Radiance | None
    paths: int
    progress: Callable[[int], None] = lambda _: None

    @cached_property
    def lenses(self) -> list[ThinLens]:
        aperture = aperture_for(sharp_share(self.scene))
        return three_views(ThinLens(self.description.sphere, SIZE, 0, 0, aperture))

    def rows(self) -> list[Row]:
        """The rows, one a view."""
        truths = light_traced(self.scene, self.lenses, self.paths, 17, self.progress)
        views = zip(VIEWS, self.lenses, truths, strict=True)
        return [self._view_row(*view) for view in views]

    def _view_row(self, title: str, lens: ThinLens, truth: Picture) -> Row:
        rng = np.random.default_rng(4)
        student, lit = field_view(self.surface, self.student, lens, SPP, rng)
        mask = means(lit, BLOCK) > 0.5
        fields = {"Student": student}
        if self.teacher is not None:
            taught, _ = field_view(self.surface, self.teacher, lens, TEACHER_SPP, rng)
            fields = {"Teacher": taught, "Student": student}
        grade = lamp_grade(self.description.flux, truth.image[lit], 93)
        shots = [_truth_shot(grade, truth, mask)]
        for name, picture in fields.items():
            shots.append(Shot(name, grade.uri(picture.image), _errors(picture, truth, mask)))
        shots.append(Shot("Error of the student", _error_map(student, truth, mask)))
        text = (
            f"Through a lens of {100 * lens.aperture:.0f} % of its distance. The reference is "
            "light traced out of the lamp. Errors are those of means over "
            f"{BLOCK}x{BLOCK} pixels; noise is judged from two independent halves of each "
            f"picture. The map is white from {100 * HEAT_WHITE:.0f} % error."
        )
        return Row(title, text if title == VIEWS[0] else "", shots)


def _truth_shot(grade: Grade, truth: Picture, mask: Mask) -> Shot:
    figures = Comparison(truth.blocks(BLOCK), truth.blocks(BLOCK), mask).noise()
    own = {
        "own noise, MAPE": f"{100 * figures['mape_of_reference']:.1f} %",
        "own noise, relative MSE": f"{figures['relative_mse_of_reference']:.4f}",
        "own noise, HDR-FLIP": f"{figures['hdr_flip_of_reference']:.3f}",
    }
    return Shot("Reference", grade.uri(truth.image), own)


def _errors(picture: Picture, truth: Picture, mask: Mask) -> dict[str, str]:
    figures = Comparison(picture.blocks(BLOCK), truth.blocks(BLOCK), mask).errors()
    return {
        "MAPE, noise taken out": f"{100 * figures['mape_without_noise']:.1f} %",
        "MAPE as measured": f"{100 * figures['mape']:.1f} %",
        "relative MSE, noise taken out": f"{figures['relative_mse_without_noise']:.4f}",
        "HDR-FLIP": f"{figures['hdr_flip']:.3f}",
        "mean": f"{100 * figures['mean']:+.1f} %",
    }


def _error_map(picture: Picture, truth: Picture, mask: Mask) -> str:
    image, reference = (p.blocks(BLOCK).image for p in (picture, truth))
    error = np.abs(image - reference) / (reference + 0.01 * reference[mask].mean())
    shown = np.kron(np.where(mask, error.mean(-1), 0), np.ones((BLOCK, BLOCK)))
    return heat(shown, HEAT_WHITE)
