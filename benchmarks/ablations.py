"""The paper's ablations: what each of its choices is worth.

python -m benchmarks.ablations --output out/bench/routes [--lamps frosted_globe filament_bulb]

Appearance: teacher, its student, and two flows on the bounding sphere, all from the records and
with the optimisation of one `draft` run. Samplers: a flow and 16x16 cells, from one student.
Figures go to stdout and OUTPUT/ablations.json; the runs are those of `benchmarks.routes`.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from benchmarks.routes import VARIANTS, Bench, Figures
from purelight_format import atomic
from purelight_mitsuba import platform

if TYPE_CHECKING:  # Mitsuba's variant must be set before it is imported
    from purelight_train.learning.cap_samples import CapSamples
    from purelight_train.light.radiance_field import Radiance
    from purelight_train.networks.sampler import Sampler
    from purelight_train.runs.pipeline import Training

TEACHER_SPP = 4


def trained(bench: Bench) -> Training:
    """The lamp's run of the route `teacher`, up to its student."""
    from purelight_train.runs.pipeline import start

    folder = bench.output / f"{bench.lamp}-teacher"
    preset = VARIANTS["teacher"].preset
    training = start(bench.scene, folder, preset, 0, "cpu", resume=True)
    training.lamp.store()
    training.student  # noqa: B018 - trained when first named
    return training


def appearances(training: Training) -> dict[str, Callable[[], Radiance]]:
    """How each representation comes by its radiance."""
    from purelight_train.ablations.shell import Shell4D, ShellFactorised
    from purelight_train.runs.evaluation import as_function

    teacher = training.teacher
    assert teacher is not None
    return {
        "student": lambda: as_function(training.student, torch.device("cpu")),
        "teacher": lambda: teacher.radiance,
        "shell-4d": lambda: _shell(training, Shell4D),
        "shell-4d-factorised": lambda: _shell(training, ShellFactorised),
    }


def _shell(training: Training, kind: Callable[..., Any]) -> Radiance:
    """Train a density on the sphere as the teacher's flow was trained."""
    from purelight_train.ablations.shell import ShellAppearance
    from purelight_train.learning.teacher import PowerBatches

    description, preset = training.lamp.description, training.preset
    torch.manual_seed(0)
    shell = kind(description, preset)
    batches = PowerBatches(training.lamp.traced[0], torch.device("cpu"))

    def loss(rng: np.random.Generator) -> torch.Tensor:
        position, _, outgoing, channel = batches.draw(rng, preset.teacher.batch)
        return -shell.log_pdf(position, outgoing, channel).mean()

    _optimise(training, shell, loss, preset.teacher)
    return ShellAppearance(description, shell).radiance


def samplers(training: Training) -> Figures:
    """Held-out likelihood and efficiency of the flow and of the histogram."""
    from purelight_train.ablations.histogram_sampler import HistogramSampler
    from purelight_train.learning.cap_samples import CapSamples
    from purelight_train.learning.training_sets import SamplerBatches
    from purelight_train.networks.sampler import Sampler
    from purelight_train.runs.evaluation import as_function

    lamp, preset = training.lamp, training.preset
    radiance = as_function(training.student, torch.device("cpu"))
    seen, unseen = (
        CapSamples.gather(lamp.description, lamp.surface, radiance, count, training.stages.rng(s))
        for count, s in ((preset.cap_points, "cap"), (1 << 10, "sampler"))
    )
    batches, results = SamplerBatches(seen), {}
    for name, kind in (("flow", Sampler), ("histogram-16x16", HistogramSampler)):
        torch.manual_seed(0)
        sampler = kind(lamp.description, preset)

        def loss(rng: np.random.Generator, own: Sampler = sampler) -> torch.Tensor:
            square, point = batches.draw(rng, preset.sampler.batch)
            return -own.log_density(torch.from_numpy(square), torch.from_numpy(point)).mean()

        seconds = _optimise(training, sampler, loss, preset.sampler)
        results[name] = {"seconds": seconds} | efficiency(sampler, unseen)
    return results


@torch.no_grad()
def efficiency(sampler: Sampler, samples: CapSamples) -> Figures:
    r"""How well a sampler fits what is seen from points it was not trained on.

    Returns:
        `nats`: mean log-density over the uniform cap of directions drawn by luminance;
        `effective`: mean over the points of :math:`(\int L)^2 / \int L^2 / p`, the effective
        sample size per sample.
    """
    points, cells = samples.square.shape[:2]
    point = torch.from_numpy(samples.point).repeat_interleave(cells, 0)
    square = torch.from_numpy(samples.square.reshape(-1, 2))
    log = sampler.log_density(square, point).numpy().reshape(points, cells).astype(np.float64)
    light = samples.luminance().astype(np.float64)
    lit = light.sum(1) > 0
    log, light = log[lit], light[lit]
    b = sampler.uniform_fraction
    pdf = (1 - b) * np.exp(log) + b
    effective = light.mean(1) ** 2 / (light**2 / pdf).mean(1)
    return {
        "nats": float(np.average(log, weights=light / light.sum(1, keepdims=True))),
        "effective": float(effective.mean()),
    }


def _optimise(training: Training, module: Any, loss: Any, settings: Any) -> float:
    begin = time.process_time()
    training.stages.try_out(module, loss, settings)
    return time.process_time() - begin


def measure(bench: Bench) -> Figures:
    """All figures of one lamp."""
    training = trained(bench)
    looks = {
        name: bench.errors(training, make(), SPP_OF.get(name, 16))
        for name, make in appearances(training).items()
    }
    return {"appearance": looks, "sampler": samplers(training)}


SPP_OF = dict.fromkeys(("teacher", "shell-4d", "shell-4d-factorised"), TEACHER_SPP)


def main() -> None:
    """Parse the command line and measure."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ablations", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/bench/routes"))
    parser.add_argument("--lamps", nargs="+", default=["frosted_globe", "filament_bulb"])
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    platform.use()
    torch.set_num_threads(arguments.threads)
    report = arguments.output / "ablations.json"
    results = json.loads(report.read_text()) if report.is_file() else {}
    for lamp in arguments.lamps:
        results[lamp] = measure(Bench(lamp, arguments.output))
        atomic.write_bytes(report, (json.dumps(results, indent=2) + "\n").encode())
        _print(lamp, results[lamp])


def _print(lamp: str, figures: Figures) -> None:
    print("| lamp | appearance | nats | MAPE | (noise) | without noise | HDR-FLIP |")
    print("|---|---|---|---|---|---|---|")
    for name, row in figures["appearance"].items():
        columns = ("mape", "mape_of_reference", "mape_without_noise", "hdr_flip")
        values = " | ".join(f"{row[c]:.3f}" for c in ("held_out_gain_nats", *columns))
        print(f"| {lamp} | {name} | {values} |")
    print("| lamp | sampler | nats | effective samples | seconds |\n|---|---|---|---|---|")
    for name, row in figures["sampler"].items():
        print(
            f"| {lamp} | {name} | {row['nats']:.3f} | {row['effective']:.3f} "
            f"| {row['seconds']:.0f} |"
        )


if __name__ == "__main__":
    main()
