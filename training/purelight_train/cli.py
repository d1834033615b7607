"""`purelight-train`: a luminaire scene becomes a run directory of trained networks."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_format.ray_file.files import is_ray_file
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from purelight_import import options
from purelight_train.device import begin
from purelight_train.presets import ANCHORS, PRESETS

COMMAND = "purelight-train"
LARGEST = 5e-3  # tolerance: half of what light may leave beside its surface


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("luminaire", type=Path, help="Mitsuba 3 scene that holds only a lamp, "
                        "a ray file, or any file that purelight-import reads")  # fmt: skip
    parser.add_argument("--output", type=Path, required=True, metavar="RUN", help="run directory")
    parser.add_argument("--preset", choices=tuple(PRESETS), default="draft",
                        help="size of it all: a try, minutes (the default), "
                             "an hour, a GPU")  # fmt: skip
    parser.add_argument("--route", choices=("photons", "teacher"), default="photons",
                        help="fit light directly, or distil a teacher as in the paper")  # fmt: skip
    parser.add_argument(
        "--anchor",
        choices=("auto", *ANCHORS),
        help="encode where a ray passes the lamp's centre, outside or inside the "
        "glass; auto tries what suits the lamp; the default for photons",
    )
    parser.add_argument("--mixed-precision", action="store_true",
                        help="train dense layers in bfloat16: for GPUs")  # fmt: skip
    parser.add_argument("--seed", type=command.seed, default=0, help="of all random numbers")
    parser.add_argument("--early-stop", action="store_true",
                        help="end once the error on held-out light stops falling")  # fmt: skip
    parser.add_argument("--exit-surface", default="auto", metavar="WHERE",
                        help="of measured rays: start, tight, auto, or a mesh file")  # fmt: skip
    parser.add_argument(
        "--tolerance",
        type=_tolerance,
        metavar="PART",
        help="most that the exit surface may be moved to have fewer triangles, "
        "over the lamp's radius; 0 leaves it as it is; the preset's if not given",
    )
    parser.add_argument("--verdict", action=argparse.BooleanOptionalAction, default=True,
                        help="measure with fresh light what was learned")  # fmt: skip
    parser.add_argument("--report", action=argparse.BooleanOptionalAction, default=True,
                        help="write report.html into the run directory")  # fmt: skip
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--threads", type=command.whole(1), default=os.cpu_count() or 1,
                        help="CPU threads")  # fmt: skip
    options.add(parser)
    return parser


def _tolerance(text: str) -> float:
    """A part of the lamp's radius."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= LARGEST:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and {LARGEST}")
    return value


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    return command.run(COMMAND, lambda: _train(_parser().parse_args(argv)))


def _train(arguments: argparse.Namespace) -> int:
    atomic.check_folder(arguments.output)
    device = begin(arguments.device, arguments.threads)
    with command.told(COMMAND):
        return _run(arguments, device)


def _run(arguments: argparse.Namespace, device: str) -> int:
    """Train the lamp; Mitsuba's variant is set."""
    from purelight_train.foreign import scene_of
    from purelight_train.runs.pipeline import start

    preset = replace(PRESETS[arguments.preset], mixed_precision=arguments.mixed_precision)
    if arguments.tolerance is not None:
        preset = replace(preset, tolerance=arguments.tolerance)
    anchor = arguments.anchor or ("auto" if arguments.route == "photons" else "none")
    with scene_of(arguments.luminaire, arguments.output, options.Options.of(arguments)) as lamp:
        if arguments.tolerance is not None and is_ray_file(lamp.scene):
            raise PureLightError(
                f"{lamp.scene}: the surface around rays is not simplified; leave --tolerance out"
            )
        training = start(
            lamp.scene, arguments.output, preset, arguments.seed, device,
            resume=arguments.resume, route=arguments.route, anchor=anchor,
            early_stop=arguments.early_stop, exit_surface=arguments.exit_surface,
            judged=arguments.verdict, look=lamp.look,
        )  # fmt: skip
    metrics = training(judged=arguments.verdict)
    if arguments.report:
        from purelight_train.report.training import write_report

        write_report(training)
    found = read(metrics.get("verdict"))
    if found is not None:
        print(*judge(found, training.stages.run.provenance).lines, sep="\n")
    flux = ", ".join(f"{f:.4g}" for f in metrics["flux"])
    print(f"{arguments.output}: flux {flux} W; next: purelight-export {arguments.output} "
          "--output lamp.plux")  # fmt: skip
    return 0
