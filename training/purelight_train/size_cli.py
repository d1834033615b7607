"""`purelight-size`: a trained run becomes one of smaller networks, by their error or their tier."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from purelight_format import atomic, command
from purelight_format.networks.tiers import TIERS
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from purelight_train import threads

COMMAND = "purelight-size"


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("run", type=Path, help="a finished run of purelight-train")
    parser.add_argument("--output", type=Path, required=True, metavar="RUN", help="run directory")
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument(
        "--target-error", type=command.number(0, 1), metavar="E",
        help="mean relative difference from the run's own networks, such as 0.05",
    )  # fmt: skip
    wanted.add_argument(
        "--tier", choices=tuple(TIERS),
        help="the best networks that are portable: any GPU and shading language affords them",
    )  # fmt: skip
    parser.add_argument("--threads", type=command.whole(1), default=os.cpu_count() or 1,
                        help="CPU threads")  # fmt: skip
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    return command.run(COMMAND, lambda: _size(_parser().parse_args(argv)))


def _size(arguments: argparse.Namespace) -> int:
    atomic.check_folder(arguments.output)
    threads.use(arguments.threads)
    from purelight_mitsuba import platform

    platform.use("llvm_ad_rgb")
    threads.use_for_tracing(arguments.threads)

    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.sizes.right_size import right_size
    from purelight_train.sizes.student import table

    trials, others = right_size(arguments.run, arguments.output, arguments.target_error, "cpu")
    print(table(trials))
    print(", ".join(f"{name.replace('_', ' ')} {value}" for name, value in others.items()))
    made = RunDirectory.open(arguments.output)
    found = read(made.read_json("metrics.json").get("verdict"))
    if found is not None:
        print(*judge(found, made.provenance).lines, sep="\n")
    print(f"{arguments.output}: the last size; next: purelight-export {arguments.output} "
          "--output lamp.plux")  # fmt: skip
    return 0
