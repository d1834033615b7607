"""The paper's ablation of the sampler: 16x16 cells in place of the flow (its Sec. 4.5)."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.systems.protocol import Cost, Subject
from benchmarks.systems.rivals.accounts import Account, stage_seconds
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem
from purelight_format.errors import PureLightError

if TYPE_CHECKING:  # they need Mitsuba's variant
    from purelight_train.ablations.histogram_sampler import HistogramSampler
    from purelight_train.runs.run_directory import RunDirectory

REPLACED = ("sampler", "fast_map")


class Histogram(BundleSystem):
    """Our own bundle whose directions are drawn by a histogram of 16x16 cells.

    The histogram is trained from the same samples and for as many steps as the flow: our student,
    our pilot, all of the sampler's steps at once. Appearance and bias are ours; noise is what
    differs. Seconds are those of our run but for its sampler and map, and of the histogram.
    """

    name = "histogram"
    label = "Ours with the paper's histogram sampler: 16x16 cells in place of the flow"

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Train the histogram; our own networks are there."""
        own = super().prepare(subject, folder)
        told = stage_seconds(subject)
        ours = sum(seconds for name, seconds in told.items() if name not in REPLACED)
        return Cost(own.seconds + ours, own.megabytes, {**own.parts, "ours": ours})

    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Train the histogram beside our networks, and put it in the flow's place."""
        from benchmarks.systems.rivals import histogram_graph
        from benchmarks.systems.rivals.rebundle import with_networks

        with account.stage("sampler"):
            network = self._trained(subject, folder / "run")
        models = {
            "sampler": histogram_graph.sampler(network),
            "sampler_pdf": histogram_graph.sampler_pdf(network),
        }
        with_networks(subject.bundle, folder / BUNDLE, models)

    def _trained(self, subject: Subject, folder: Path) -> HistogramSampler:
        from purelight_train.ablations.histogram_sampler import HistogramSampler
        from purelight_train.runs.pipeline import reopen
        from purelight_train.runs.trained import SAMPLER
        from purelight_train.runs.trainer import Trained

        run = _copied(subject.run, folder)
        declared: Trained[HistogramSampler] = Trained(
            "histogram",
            HistogramSampler,
            settings=lambda trainer: trainer.preset.sampler,
            loss=SAMPLER.loss,
        )
        return reopen(run, subject.scene).network(declared)


def _copied(source: Path, folder: Path) -> RunDirectory:
    """A run to go on with, without touching the subject's.

    Raises:
        PureLightError: the subject's run has no sampler.
    """
    from purelight_train.runs.run_directory import RunDirectory

    run = RunDirectory.open(source)
    if not run.finished("sampler"):
        raise PureLightError(f"{source}: has no sampler, so there is none to replace")
    shutil.copytree(source, folder, dirs_exist_ok=True)
    return RunDirectory(folder)
