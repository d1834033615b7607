"""Train lamps, export them, and print how near they are to the truth.

python -m benchmarks --output out/bench [--preset draft] [--routes teacher photons]
    [--lamps frosted_globe filament_bulb] [--size 128] [--paths 67108864]
    [--threads 1]
python -m benchmarks --checks appearance --reuse out/demo

A folder to reuse is one of the demo (`run`, `lamp.plux` in it), or a run directory with the bundle
beside it (FOLDER.plux); nothing is trained or exported then.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_mitsuba import platform
from tests.support.trained import prepare

COLUMNS = {  # Format, and where the figure is.
    "s": (".0f", "seconds"),
    "MB": (".1f", "megabytes"),
    "nats": (".3f", "held_out_gain_nats"),
    "MAPE": (".3f", "appearance", "student_truth", "mape"),
    "(noise)": (".3f", "appearance", "student_truth", "mape_of_reference"),
    "without noise": (".3f", "appearance", "student_truth", "mape_without_noise"),
    "relMSE": (".4f", "appearance", "student_truth", "relative_mse_without_noise"),
    "HDR-FLIP": (".3f", "appearance", "student_truth", "hdr_flip"),
    "teacher-truth": (".3f", "appearance", "teacher_truth", "mape_without_noise"),
    "student-teacher": (".3f", "appearance", "student_teacher", "mape_without_noise"),
    "irradiance": ("+.3f", "irradiance", "accurate", "mean"),
    "(abs)": (".3f", "irradiance", "accurate", "mean_absolute_over_mean"),
    "T, 15°": ("+.3f", "transmittance", "panel of 15.0 degrees", "mean"),
    "(RMS)": (".3f", "transmittance", "panel of 15.0 degrees", "root_mean_square"),
    "T, 90°": ("+.3f", "transmittance", "panel of 89.9 degrees", "mean"),
    "(RMS, 90°)": (".3f", "transmittance", "panel of 89.9 degrees", "root_mean_square"),
    "sampler ESS": (".2f", "sampler", "effective_sample_size"),
    "map bias": ("+.3f", "fast_map", "irradiance_bias"),
}


def main() -> int:
    """Run the checks on the lamps; figures go to stdout and OUTPUT/fidelity-PRESET.json.

    A table of all figures in that file, those of earlier calls included, ends the output.
    """
    parser = command.Parser(prog="python -m benchmarks", description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/bench"))
    add("--preset", default="draft")
    add("--routes", nargs="+", default=["photons"], choices=("teacher", "photons"))
    add("--lamps", nargs="+", default=["frosted_globe", "filament_bulb"])
    add("--checks", nargs="+", help="some of flux irradiance appearance ...")
    add("--size", type=command.whole(1), default=128, help="pixels of `appearance`, a side")
    add("--paths", type=command.whole(1), default=1 << 26, help="of the truth of `appearance`")
    add("--threads", type=command.whole(1), default=os.cpu_count(), help="of the training")
    add("--reuse", nargs="+", type=Path, metavar="FOLDER", help="finished runs")
    arguments = parser.parse_args()
    results = _results(arguments)
    kind = "reuse" if arguments.reuse else arguments.preset
    report = arguments.output / f"fidelity-{kind}.json"
    report.parent.mkdir(parents=True, exist_ok=True)
    earlier = json.loads(report.read_text()) if report.is_file() else {}
    for name, figures in results.items():
        earlier[name] = earlier.get(name, {}) | figures
    atomic.write_bytes(report, (json.dumps(earlier, indent=2) + "\n").encode())
    print(table(earlier))
    return 0


def _results(arguments: argparse.Namespace) -> dict[str, Any]:
    """Figures by lamp, or by folder that is reused."""
    if arguments.reuse:
        subjects = {str(folder): partial(reuse, folder) for folder in arguments.reuse}
    else:
        subjects = {
            f"{lamp} {route}": partial(
                prepare, lamp, arguments.output, arguments.preset, route, arguments.threads
            )
            for lamp in arguments.lamps
            for route in arguments.routes
        }
    truth = {"size": arguments.size, "paths": arguments.paths}
    return {n: measure(n, make(), arguments.checks, truth) for n, make in subjects.items()}


def measure(
    name: str, subject: Any, chosen: list[str] | None, truth: dict[str, int]
) -> dict[str, Any]:
    """Figures of every chosen check for one lamp; `truth` is the one of `appearance`."""
    from benchmarks.checks import CHECKS
    from tests.support.fidelity import appearance

    checks = CHECKS | {"appearance": lambda of: appearance(of, truth["size"], truth["paths"])}
    unknown = set(chosen or ()) - set(checks)
    if unknown:
        raise PureLightError(f"no check {sorted(unknown)}; choose from {' '.join(checks)}")
    results = cost(subject)
    for check in chosen or list(checks):
        start = time.monotonic()
        results[check] = checks[check](subject)
        print(f"{name} {check} ({time.monotonic() - start:.0f} s): {json.dumps(results[check])}")
    return results


def cost(subject: Any) -> dict[str, Any]:
    """What a run took and gave: seconds, megabytes, and nats of held-out light."""
    from purelight_train.runs.run_directory import RunDirectory

    metrics = RunDirectory.open(subject.run).read_json("metrics.json")
    return {
        "seconds": sum(metrics["seconds"].values()),
        "megabytes": subject.bundle.stat().st_size / 1e6,
        "held_out_gain_nats": metrics["held_out_gain_nats"],
    }


def table(results: dict[str, dict[str, Any]]) -> str:
    """The main figures as Markdown; a dash where a check was not run."""
    rows = ["| " + " | ".join(("lamp", *COLUMNS)) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for name, figures in results.items():
        cells = [_cell(figures, *column) for column in COLUMNS.values()]
        rows.append("| " + " | ".join((name, *cells)) + " |")
    return "\n".join(rows)


def _cell(figures: dict[str, Any], style: str, *path: str) -> str:
    value: Any = figures
    for key in path:
        value = value.get(key) if isinstance(value, dict) else None
    return "-" if value is None else format(value, style)


def reuse(folder: Path) -> Any:
    """A run and its bundle, made earlier.

    Raises:
        PureLightError: one of them, or the lamp's scene, is missing.
    """
    platform.use()
    import purelight_mitsuba
    from purelight_train.runs.run_directory import RunDirectory
    from tests.support.fidelity import Subject

    demo = (folder / "run").is_dir()
    run = folder / "run" if demo else folder
    bundle = folder / "lamp.plux" if demo else folder.with_name(folder.name + ".plux")
    trained = Path(RunDirectory.open(run).config["luminaire"])
    scene = folder / "luminaire" / trained.name if demo else trained
    for file in (bundle, scene):
        if not file.is_file():
            raise PureLightError(f"{file}: no such file; export the run first, or name another")
    purelight_mitsuba.register()
    return Subject(scene, run, bundle)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks", main))
