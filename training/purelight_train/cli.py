"""`purelight-train`: a luminaire scene becomes a run directory of trained networks."""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from purelight_format import atomic, command
from purelight_train import threads
from purelight_train.presets import ANCHORS, PRESETS

COMMAND = "purelight-train"
AUTO = "auto"  # For --keep.
LAMP = "lamp"  # Folder of a lamp without its kept parts, in its run.


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("luminaire", type=Path, help="Mitsuba 3 scene that holds only a lamp")
    parser.add_argument("--output", type=Path, required=True, metavar="RUN", help="run directory")
    parser.add_argument("--preset", choices=sorted(PRESETS), default="draft")
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
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--early-stop", action="store_true",
                        help="end once the error on held-out light stops falling")  # fmt: skip
    parser.add_argument("--report", action=argparse.BooleanOptionalAction, default=True,
                        help="write report.html into the run directory")  # fmt: skip
    parser.add_argument("--keep", action="append", default=[], metavar="PART",
                        help="leave a dark part out of the networks, as geometry of the asset; "
                        "auto: all opaque ones away from the light; may be repeated")  # fmt: skip
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="CPU threads")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    return command.run(COMMAND, lambda: _train(_parser().parse_args(argv)))


def _train(arguments: argparse.Namespace) -> int:
    atomic.check_folder(arguments.output)
    threads.use(arguments.threads)
    import torch

    from purelight_mitsuba import platform

    device = arguments.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    platform.use("llvm_ad_rgb" if device == "cpu" else "cuda_ad_rgb")

    with kept_apart(arguments.luminaire, arguments.keep, arguments.output) as scene:
        return _run(arguments, scene, device)


@contextmanager
def kept_apart(scene: Path, names: Sequence[str], run: Path) -> Iterator[Path]:
    """The lamp without the parts that are kept, in the run's folder.

    It is taken away again if the block fails before the run has begun.
    """
    if not names:
        yield scene
        return
    from purelight_train.split import part_names, split

    chosen = {name for name in names if name != AUTO}
    if AUTO in names and part_names(scene):
        from purelight_train.light.kept import parts_away

        chosen |= set(parts_away(scene))
    folder = run / LAMP
    fresh = not run.exists(), not folder.exists()
    if not chosen:
        command.warn(COMMAND, "--keep auto: no opaque part is away from the light; none is kept")
    lamp = split(scene, sorted(chosen), folder) if chosen else scene
    try:
        yield lamp
    except BaseException:
        if fresh[1] and not (run / "config.json").is_file():
            shutil.rmtree(folder, ignore_errors=True)
            if fresh[0]:
                with suppress(OSError):
                    run.rmdir()
        raise


def _run(arguments: argparse.Namespace, scene: Path, device: str) -> int:
    """Train the lamp; Mitsuba's variant is set."""
    from purelight_train.runs.pipeline import start

    preset = replace(PRESETS[arguments.preset], mixed_precision=arguments.mixed_precision)
    anchor = arguments.anchor or ("auto" if arguments.route == "photons" else "none")
    training = start(
        scene, arguments.output, preset, arguments.seed, device,
        resume=arguments.resume, route=arguments.route, anchor=anchor,
        early_stop=arguments.early_stop,
    )  # fmt: skip
    metrics = training()
    if arguments.report:
        from purelight_train.report.training import write_report

        write_report(training)
    flux = ", ".join(f"{f:.4g}" for f in metrics["flux"])
    print(f"{arguments.output}: flux {flux} W; held-out gain "
          f"{metrics['held_out_gain_nats']:.3f} nats; next: purelight-export {arguments.output} "
          "--output lamp.plux")  # fmt: skip
    return 0
