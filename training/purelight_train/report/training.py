"""The page of a training run: pictures, curves, figures and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from purelight_format.verdict import words
from purelight_format.verdict.figures import read
from purelight_train.light.measured_luminaire import MeasuredLuminaire
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.report.caps import CapMaps
from purelight_train.report.measured import MeasuredLight
from purelight_train.report.page import Cover, Curves, Section, Table, Warnings, write_page
from purelight_train.report.views import LampViews
from purelight_train.runs.evaluation import as_function
from purelight_train.runs.progress import Bar, duration
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import ASTRAY

if TYPE_CHECKING:
    from purelight_train.runs.pipeline import Training


def write_report(training: Training) -> None:
    """Write report.html of a finished run, with the pictures of its verdict."""
    run, lamp = training.stages.run, training.lamp
    student = as_function(training.student, training.stages.device)
    networks = run.network("sampler", Sampler), run.network("fast_map", FastMap)
    luminaire = lamp.luminaire
    if isinstance(luminaire, MeasuredLuminaire):
        truth = _measured(training, luminaire)
    else:
        truth = _views(training)
    caps = CapMaps(lamp.description, lamp.surface, student, *networks).rows()
    TrainingReport(run, [*truth, *caps]).write()


def _measured(training: Training, luminaire: MeasuredLuminaire) -> list[Section]:
    """Rays and what was learned of them."""
    lamp = training.lamp
    student = as_function(training.student, training.stages.device)
    facts = training.stages.run.read_json("metrics.json")["measured"]
    return [*MeasuredLight(facts, luminaire.records, lamp.reference_rays, student).tables()]


def _views(training: Training) -> list[Section]:
    """Pictures of the lamp, traced and learned."""
    lamp, judge = training.lamp, training.judge
    if "views" not in vars(judge):  # there was no verdict
        with Bar("report", judge.total, "path", lambda _: None) as judge.progress:
            judge.views  # noqa: B018 - each part is measured when it is first asked for
    teacher = training.route.teacher_radiance
    return [*LampViews(lamp.description, lamp.surface, judge.views, teacher).rows()]


@dataclass(frozen=True)
class TrainingReport:
    """A run's figures around rows of pictures, and tables beside them."""

    run: RunDirectory
    pictures: Sequence[Section]

    def write(self) -> None:
        """Write report.html into the run directory."""
        title = self.run.config["luminaire"].replace("\\", "/").rsplit("/", 1)[-1]
        title = title.rsplit(".", 1)[0].replace("_", " ").capitalize()
        sections: list[Section] = [
            *self._cover(), Warnings(self.warnings()), *self.pictures, self._curves(),
            self._networks(), self._light(),
        ]  # fmt: skip
        write_page(self.run.path / "report.html", title, self._lead(), sections)

    def _cover(self) -> list[Section]:
        """The verdict, if there is one."""
        found = read(self.metrics.get("verdict"))
        if found is None:
            return []
        told = words.judge(found, self.run.provenance)
        return [Cover(told.caption, told.lines)]

    @cached_property
    def metrics(self) -> dict[str, Any]:
        """Contents of metrics.json."""
        return self.run.read_json("metrics.json")

    def warnings(self) -> list[str]:
        """What went wrong or may have."""
        found = []
        for name, count in self.metrics["skipped_steps"].items():
            if count:
                found.append(f"{count} steps of the {name.replace('_', ' ')} were skipped: their "
                             "gradient was not finite. A handful does no harm.")  # fmt: skip
        for name, count in self.metrics.get("astray", {}).items():
            found.append(ASTRAY.format(count, name.replace("_", " ")))
        dropped = self.metrics.get("dropped", 0)
        if dropped:
            found.append(f"{dropped} light paths were dropped because a value was not finite; "
                         "check the lamp's materials and textures.")  # fmt: skip
        true = np.asarray(self.metrics["flux"])
        off = np.abs(np.asarray(self.metrics["student_flux"]) - true) / np.maximum(true, 1e-300)
        if off.max() > 0.03:
            found.append(f"The student sends out {100 * off.max():.1f} % more or less light than "
                         "the lamp; train longer or with a larger preset.")  # fmt: skip
        if self.metrics["held_out_gain_nats"] < 0:
            found.append("Light kept from training is less likely under the student than under a "
                         "plain glowing surface; it has not learned this lamp.")  # fmt: skip
        return found

    def _lead(self) -> str:
        config = self.run.config
        flux = " / ".join(f"{f:.3g}" for f in self.metrics["flux"])
        return (
            f"Preset {config['preset']['name']}, route {config['route']}, trained in "
            f"{duration(sum(self.metrics['seconds'].values()))}. The lamp sends out {flux} W in "
            "R, G and B. Pictures are balanced towards its colour; every picture of a row has the "
            "same exposure."
        )

    def _networks(self) -> Table:
        rows = []
        for name, losses in self.metrics["losses"].items():
            size = self.run.tensor_file(name).stat().st_size
            rows.append([
                name.replace("_", " "), f"{size / 1e6:.2f} MB",
                duration(self.metrics["seconds"][name]), f"{losses[-1]:.4g}" if losses else "",
            ])  # fmt: skip
        header = ("Network", "size in training", "time", "last loss")
        return Table("What was trained", header, rows)

    def _light(self) -> Table:
        metrics = self.metrics
        rows = [
            [channel, *(f"{metrics[key][c]:.5g} W" for key in ("flux", "flux_error")),
             f"{metrics['student_flux'][c]:.5g} W", f"{metrics['flux_gain'][c]:.4f}"]
            for c, channel in enumerate(("Red", "Green", "Blue")) if metrics["flux"][c] > 0
        ]  # fmt: skip
        rows.append(["Held-out light", f"{metrics['held_out_gain_nats']:+.3f} nats", "", "", ""])
        header = ("Light", "traced", "standard error", "student", "gain that closed it")
        return Table("Where the light went", header, rows)

    def _curves(self) -> Curves:
        curves = {k.replace("_", " ").capitalize(): v for k, v in self.metrics["losses"].items()}
        text = "Mean loss over each hundredth of the steps; every curve has its own range."
        return Curves("Training", text, curves)
