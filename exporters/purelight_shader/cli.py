"""`purelight-shader`: a `.plux` bundle becomes functions in a shading language, or in C++."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from purelight_format import command
from purelight_format.bundle import Bundle
from purelight_shader.output.folder import PREFIX, write
from purelight_shader.output.targets import TARGETS

COMMAND = "purelight-shader"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _write(_parser().parse_args(argv)))


def _write(options: argparse.Namespace) -> int:
    bundle = Bundle.open(options.bundle)
    written = write(bundle, options.language, options.output, options.prefix)
    for path in written:
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("bundle", type=Path, help="lamp.plux")
    parser.add_argument("--language", choices=tuple(TARGETS), required=True)
    parser.add_argument("--output", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--prefix", type=_prefix, default="purelight",
        help="what all names begin with, for several lamps in one program (default: purelight)",
    )  # fmt: skip
    return parser


def _prefix(text: str) -> str:
    if not PREFIX.fullmatch(text):
        raise argparse.ArgumentTypeError(f"{text}: give small letters and digits, a letter first")
    return text
