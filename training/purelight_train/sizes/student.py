"""Right size of the student: the smallest that is as near to the run's own as one asks.

Students of growing size learn the run's student, which is quick: it can be asked anywhere, without
noise. Each is trained for a part of the steps, its error read twice and extrapolated; the smallest
that will reach the target is then trained in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from purelight_format.errors import PureLightError
from purelight_train.learning.flux_closure import cell_directions
from purelight_train.learning.training_sets import viewed_rays
from purelight_train.networks.student import Student, shaken
from purelight_train.presets import Optimisation
from purelight_train.runs.evaluation import as_function, close_flux
from purelight_train.runs.stages import Stages, rows
from purelight_train.runs.traced_lamp import TracedLamp
from purelight_train.sizes.ladder import Rung, ladder

FLOOR = 0.01  # of the mean radiance, as in `truth.metrics.mape`
LINES, HELD_OUT_LINES = 1 << 21, 1 << 17
FULL = Optimisation(4000, 1 << 13, 1e-2)
TRIAL = 400
Rays = tuple[Tensor, ...]


@dataclass(frozen=True)
class Trial:
    """What a size promises.

    Arguments:
        half, whole: error after half of the trial's steps, and after all.
    """

    rung: Rung
    half: float
    whole: float

    @property
    def expected(self) -> float:
        """Error after `FULL` steps, were it to fall as a + b / steps."""
        fall = max(self.half - self.whole, 0.0)
        return max(self.whole - fall * (1 - TRIAL / FULL.steps), 0.5 * self.whole)

    def to_dict(self) -> dict[str, Any]:
        """One row of the table."""
        preset = self.rung.preset
        return {
            "width": preset.student_network.width,
            "depth": preset.student_network.depth,
            "levels": preset.student_grid.levels,
            "finest": preset.student_grid.finest,
            "weights": self.rung.weights,
            "macs": self.rung.macs,
            "trial_error": self.whole,
            "expected_error": self.expected,
        }


@dataclass
class StudentSize:
    """Search for one lamp.

    Arguments:
        reference: the run's student, whose size is the largest.
    """

    lamp: TracedLamp
    reference: Student
    stages: Stages

    def __post_init__(self) -> None:
        self.data = self._rays(LINES, 0)
        self.held_out = self._rays(HELD_OUT_LINES, 1)

    def _rays(self, lines: int, part: int) -> Rays:
        """Position, normal, outgoing and the reference's radiance of uniform rays."""
        rng = self.stages.rng("student", 2 + part)
        rays = viewed_rays(self.lamp.surface, lines, rng, cosine=True)
        radiance = as_function(self.reference, self.stages.device)
        return self.stages.tensors(*rays, radiance(*rays))

    def error(self, student: Student) -> float:
        """MAPE against the reference over rays no student learns from, channels present."""
        *rays, true = self.held_out
        floor = FLOOR * true.mean(0)
        with torch.no_grad():
            relative = (student(*rays) - true).abs() / (true + floor).clamp(min=1e-30)
        return float(relative[:, student.channels.bool()].mean())

    def loss(self, student: Student, batch: Rays) -> Tensor:
        """Mean square error of log(radiance / scale + 1%), which is what MAPE measures."""
        position, normal, outgoing, true = batch
        scale, present = student.scale, student.channels.bool()
        value = student(position, normal, outgoing, shaken(normal))
        error = torch.log(value / scale + FLOOR) - torch.log(true / scale + FLOOR)
        return (error[:, present] ** 2).mean()

    def train(self, rung: Rung, steps: int) -> Student:
        """A student of a size after `steps` steps."""
        student = self.stages.build("student", Student, self.lamp.description, rung.preset)
        # The reference's gain is part of what is learned
        student.ceiling.copy_(self.reference.ceiling + self._most_gain())
        settings = replace(FULL, steps=steps)

        def batch_loss(rng: np.random.Generator) -> Tensor:
            return self.loss(student, rows(self.data, rng, settings.batch))

        size = rung.preset.student_network
        self.stages.try_out(f"student {size.width} x {size.depth}", student, batch_loss, settings)
        return student

    def _most_gain(self) -> Tensor:
        """Logarithm of the reference's largest gain in any direction: [3]."""
        toward = torch.from_numpy(cell_directions()).to(self.reference.gain.device)
        return torch.log(self.reference.gain) + self.reference.log_tilt(toward).amax(0)

    def trial(self, rung: Rung) -> Trial:
        """Errors of a size after two short runs, each with a whole schedule."""
        half, whole = (self.error(self.train(rung, steps)) for steps in (TRIAL // 2, TRIAL))
        return Trial(rung, half, whole)

    def __call__(self, target: float) -> tuple[Student, Rung, list[Trial]]:
        """The smallest student that reaches the target, its size, and all trials.

        Raises:
            PureLightError: none does.
        """
        trials: list[Trial] = []
        rng = self.stages.rng("student", 4)
        preset = self.stages.run.preset
        for rung in ladder(preset, self.lamp.surface, rng):
            trials.append(self.trial(rung))
            if trials[-1].expected > target:
                continue
            student = self._full(rung)
            if self.error(student) <= target:
                return student, rung, trials
        best = min(trial.expected for trial in trials)
        raise PureLightError(
            f"no size reaches an error of {target:g}; the best expected is {best:.3g}, so give a "
            "larger --target-error"
        )

    def best(self, rungs: Sequence[Rung]) -> tuple[Student, Rung, list[Trial]]:
        """The student of a few sizes that promises the least error, its size, and all trials."""
        trials = [self.trial(rung) for rung in rungs]
        chosen = min(trials, key=lambda trial: trial.expected).rung
        return self._full(chosen), chosen, trials

    def _full(self, rung: Rung) -> Student:
        """A student of a size, trained in full, whose flux is that of the lamp."""
        student = self.train(rung, FULL.steps)
        radiance = as_function(student, self.stages.device)
        close_flux(student, radiance, self.lamp, self.stages.rng("student", 1))
        return student


def table(trials: Sequence[Trial]) -> str:
    """The trials as text, a row each."""
    lines = [f"{'width':>6}{'depth':>6}{'finest':>7}{'weights':>9}{'MAC':>8}{'error':>8}"]
    for row in (trial.to_dict() for trial in trials):
        lines.append(
            f"{row['width']:6}{row['depth']:6}{row['finest']:7}{row['weights']:9}{row['macs']:8}"
            f"{row['expected_error']:8.3f}"
        )
    return "\n".join(lines)
