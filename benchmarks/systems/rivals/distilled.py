"""The paper's own route to the networks of a bundle: a teacher, distilled into a student."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem

if TYPE_CHECKING:  # they need Mitsuba's variant
    from purelight_train.runs.pipeline import Training


class Distilled(BundleSystem):
    """Student and flow sampler of the paper, at the sizes and steps of the subject's preset.

    Photon map and directional flow on the exit surface make the teacher, which the student
    regresses; the paper's own sizes are the preset `paper`. What is unlike the paper is what all of
    our runs have: the flux is closed, and the sampler is defensive.
    """

    name = "distilled"
    label = "PureLight by the paper's route (teacher, student, flow sampler), at our sizes"

    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Train and export."""
        from benchmarks.systems.rivals import proxy
        from purelight_train.runs.trained import SAMPLER, STUDENT, TRANSPARENCY

        training = taught(subject, folder, account)
        proxy.finish(training, (STUDENT, TRANSPARENCY, SAMPLER), folder / BUNDLE, account)


def taught(subject: Subject, folder: Path, account: Account) -> Training:
    """A run of the route `teacher` in `folder/run`, with its light and its teacher."""
    import torch

    from benchmarks.systems.rivals.proxy import base_preset
    from purelight_train.runs.pipeline import start

    torch.set_num_threads(subject.threads)
    run, preset = folder / "run", base_preset(subject)
    with account.stage("light"):
        training = start(subject.scene, run, preset, 0, "cpu", resume=run.exists(), route="teacher")
        training.lamp.store()
    with account.stage("teacher"):
        training.teacher  # noqa: B018 - trained when first named
    return training
