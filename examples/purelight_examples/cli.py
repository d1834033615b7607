"""`purelight-demo`: the whole job on a built-in lamp, with a report to look at."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_train.presets import PRESETS

COMMAND = "purelight-demo"
LAMPS = ("frosted_globe", "filament_bulb", "crystal")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _demo(_parser().parse_args(argv)))


def _demo(options: argparse.Namespace) -> int:
    atomic.check_folder(options.output)
    try:
        report = _run(options)
    except KeyboardInterrupt:
        print(f"{COMMAND}: stopped; run it again to go on", file=sys.stderr)
        return 130
    print(f"Look at {report}")
    return 0


def _run(options: argparse.Namespace) -> Path:
    try:
        # Before anything else loads Dr.Jit, so that it gets an LLVM it can use
        from purelight_mitsuba import platform

        platform.use()
        from purelight_examples.demo import Demo
    except ImportError as error:
        raise PureLightError(f'{error}; pip install "purelight[all]"') from None
    return Demo(options.output, options.lamp, options.preset)()


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/demo"), help="folder; finished stages are kept")
    add("--lamp", choices=LAMPS, default=LAMPS[0])
    add("--preset", choices=sorted(PRESETS), default="draft", help="of purelight-train")
    return parser
