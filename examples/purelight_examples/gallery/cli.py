"""`purelight-gallery`: every lamp trained, exported, validated, seen, and lighting a wall."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from purelight_examples.gallery.settings import Settings
from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_train.presets import PRESETS

COMMAND = "purelight-gallery"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, 1 if a lamp or a room failed, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _gallery(_parser().parse_args(argv)))


def _gallery(options: argparse.Namespace) -> int:
    try:
        from purelight_examples.gallery.gallery import Gallery
    except ImportError as error:
        raise PureLightError(f'{error}; pip install "purelight[all]"') from None
    settings = replace(Settings(), preset=options.preset, threads=options.threads)
    gallery = Gallery.of(options.output, options.lamps, options.rooms, settings)
    if options.list:
        print("\n".join(gallery.description()))
        return 0
    atomic.check_folder(options.output)
    try:
        failed = gallery()
    except KeyboardInterrupt:
        print(f"{COMMAND}: stopped; run it again to go on", file=sys.stderr)
        return 130
    print(f"Look at {gallery.page}")
    return 1 if failed else 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/gallery"), help="folder; what is done is kept")
    add("--lamps", nargs="+", metavar="LAMP", help="some of them; all by default")
    add("--rooms", nargs="*", metavar="ROOM", help="some or none; by default all with such lamps")
    add("--list", action="store_true", help="tell which lamps and rooms there are")
    add("--preset", choices=sorted(PRESETS), default="draft",
        help="of purelight-train; sketch is a first look")  # fmt: skip
    add("--threads", type=command.whole(1), default=os.cpu_count() or 1, help="CPU threads")
    return parser
