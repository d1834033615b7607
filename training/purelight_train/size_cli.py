"""`purelight-size`: a trained run becomes one whose networks are as small as an error allows."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_train import threads


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="purelight-size", description=__doc__)
    parser.add_argument("run", type=Path, help="a finished run of purelight-train")
    parser.add_argument("--output", type=Path, required=True, metavar="RUN", help="run directory")
    parser.add_argument(
        "--target-error", type=_part, required=True, metavar="E",
        help="mean relative difference from the run's own networks, such as 0.05",
    )  # fmt: skip
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="CPU threads")
    return parser


def _part(text: str) -> float:
    value = float(text)
    if not 0 < value < 1:
        raise argparse.ArgumentTypeError(f"{text}: give a number between 0 and 1")
    return value


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code, 2 for a fault the user can mend."""
    arguments = _parser().parse_args(argv)
    try:
        return _size(arguments)
    except PureLightError as error:
        print(f"purelight-size: error: {error}", file=sys.stderr)
        return 2


def _size(arguments: argparse.Namespace) -> int:
    threads.use(arguments.threads)
    from purelight_mitsuba import platform

    platform.use("llvm_ad_rgb")

    from purelight_train.sizes.right_size import right_size
    from purelight_train.sizes.student import table

    trials, others = right_size(arguments.run, arguments.output, arguments.target_error, "cpu")
    print(table(trials))
    print(", ".join(f"{name.replace('_', ' ')} {value}" for name, value in others.items()))
    print(f"{arguments.output}: the last size; next: purelight-export {arguments.output} "
          "--output lamp.plux")  # fmt: skip
    return 0
