"""What a preset costs, from a share of its steps: every network and batch at its own size.

python -m benchmarks.preset_cost --lamp lamp.xml [--preset paper] [--share 0.01] [--route photons]
    [--anchor none] [--device auto] [--threads 2] [--mixed-precision] [--output out/bench]

Trains the lamp with the preset's networks, batches, learning rates and samples, but with SHARE of
the steps of each optimisation (and of a distillation's rays); what was learned is judged as ever,
and says what so many steps give. Prints a row per stage: its seconds, those of a step, and the
hours of the whole preset, extrapolated: steps cost the same throughout, and what is done once
(light, the closing of light of student and fast map, the verdict) is whole. Writes
OUTPUT/PRESET-ROUTE-DEVICE.json; the run is in OUTPUT/PRESET-ROUTE-DEVICE.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_train.device import begin
from purelight_train.presets import ANCHORS, PRESETS, Optimisation, Preset

if TYPE_CHECKING:
    from purelight_train.runs.stages import Stages

COMMAND = "benchmarks.preset_cost"
Figures = dict[str, Any]


def main() -> int:
    """Train, print the table and write the figures."""
    parser = command.Parser(prog=f"python -m {COMMAND}", description=__doc__)
    add = parser.add_argument
    add("--lamp", type=Path, required=True, help="the lamp's scene, .xml")
    add("--output", type=Path, default=Path("out/bench"))
    add("--preset", choices=tuple(PRESETS), default="paper")
    add("--share", type=command.number(0), default=0.01, help="of the steps")
    add("--route", choices=("photons", "teacher"), default="photons")
    add("--anchor", choices=tuple(ANCHORS), default="none")
    add("--device", choices=("cpu", "cuda", "auto"), default="auto")
    add("--threads", type=command.whole(1), default=os.cpu_count() or 1)
    add("--mixed-precision", action="store_true", help="dense layers in bfloat16")
    arguments = parser.parse_args()
    figures = measure(arguments)
    print(table(figures))
    return 0


def measure(arguments: argparse.Namespace) -> Figures:
    """Trains with a share of the steps; returns the figures, which it has written."""
    if not 0 < arguments.share <= 1:
        raise PureLightError("--share must be above 0 and at most 1")
    device = begin(arguments.device, arguments.threads)
    import torch

    from purelight_train.runs.pipeline import start

    preset = replace(PRESETS[arguments.preset], mixed_precision=arguments.mixed_precision)
    name = f"{arguments.preset}-{arguments.route}-{device}"
    training = start(
        arguments.lamp, arguments.output / name, part_of(preset, arguments.share), 0, device,
        resume=False, route=arguments.route, anchor=arguments.anchor,
    )  # fmt: skip
    metrics = training()
    figures = {
        "device": torch.cuda.get_device_name() if device == "cuda" else f"{os.cpu_count()} cores",
        "share": arguments.share,
        "stages": stages(training.stages, metrics["seconds"], preset, arguments),
        **{k: metrics[k] for k in ("verdict", "held_out_gain_nats", "flux", "skipped_steps")},
    }
    file = arguments.output / f"{name}.json"
    atomic.write_bytes(file, (json.dumps(figures, indent=2) + "\n").encode())
    return figures


def part_of(preset: Preset, share: float) -> Preset:
    """The preset with a share of the steps of each optimisation, and of a distillation's rays."""
    rays = max(preset.student.batch, round(share * preset.distillation_samples))
    fewer = preset.with_steps(lambda steps: max(1, round(share * steps)))
    return replace(fewer, distillation_samples=rays)


def stages(
    made: Stages, seconds: dict[str, float], preset: Preset, arguments: argparse.Namespace
) -> list[Figures]:
    """Each stage's seconds, steps, milliseconds of a step, and hours of the whole preset."""
    small, rows = part_of(preset, arguments.share), []
    for name, spent in seconds.items():
        steps, stepped, factor = steps_of(small, name, arguments.route), spent, 1.0
        if steps:
            factor = (steps_of(preset, name, arguments.route) or steps) / steps
            stepped = made.run.read_json(f"networks/{name}.json")["step_seconds"]
        elif name == "distillation":
            factor = preset.distillation_samples / small.distillation_samples
        rows.append({
            "stage": name, "seconds": spent, "steps": steps,
            "step_milliseconds": steps and 1e3 * stepped / steps,
            "whole_hours": (factor * stepped + spent - stepped) / 3600,
        })  # fmt: skip
    return rows


def steps_of(preset: Preset, stage: str, route: str) -> int | None:
    """Steps of a stage that has any; the sampler and its pilot share theirs."""
    name = "photons" if stage == "student" and route == "photons" else stage
    settings = getattr(preset, "sampler" if stage == "pilot" else name, None)
    if not isinstance(settings, Optimisation):
        return None
    return settings.steps // 2 if stage in ("pilot", "sampler") else settings.steps


def table(figures: Figures) -> str:
    """The figures as Markdown."""
    lines = [
        f"{figures['device']}, {figures['share']:g} of the steps:",
        "| stage | s | steps | ms a step | hours of the whole |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for row in figures["stages"]:
        per_step = f"{row['steps']:,} | {row['step_milliseconds']:.1f}" if row["steps"] else "- | -"
        lines.append(
            f"| {row['stage']} | {row['seconds']:.1f} | {per_step} | {row['whole_hours']:.2f} |"
        )
    seconds = sum(row["seconds"] for row in figures["stages"])
    hours = sum(row["whole_hours"] for row in figures["stages"])
    lines.append(f"| all | {seconds:.1f} | | | {hours:.2f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(command.run(COMMAND, main))
