"""Training of the paper's shells: a density on the sphere is the teacher."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

from purelight_train.ablations.shell import Shell, Shell4D, ShellAppearance, ShellFactorised
from purelight_train.learning.teacher import PowerBatches
from purelight_train.runs.routes import TeacherRoute
from purelight_train.runs.stages import Loss


class ShellRoute(TeacherRoute):
    """The route `teacher` with another teacher."""

    kind: ClassVar[type[Shell]]

    @cached_property
    def teacher(self) -> Any:
        description = self.lamp.description
        shell: Any = self.stages.build("teacher", self.kind, description, self.preset)
        self.stages.train("teacher", shell, self._shell_loss, self.preset.teacher)
        return ShellAppearance(description, shell)

    def _shell_loss(self, shell: Shell) -> Loss:
        """Of Eq. 6, as our own teacher's."""
        batches = PowerBatches(self.lamp.records, self.stages.device)
        size = self.preset.teacher.batch

        def loss(rng: Any) -> Any:
            position, _, outgoing, channel = batches.draw(rng, size)
            return -shell.log_pdf(position, outgoing, channel).mean()

        return loss


class Shell4DRoute(ShellRoute):
    """One flow in four dimensions."""

    kind = Shell4D


class FactorisedRoute(ShellRoute):
    """A flow for the place, one for the direction."""

    kind = ShellFactorised
