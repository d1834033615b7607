"""`purelight-import`: a lamp of another format becomes a Mitsuba scene to read, edit and train."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from purelight_format import command
from purelight_format.issues import plain
from purelight_import import options

COMMAND = "purelight-import"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _import(_parser().parse_args(argv)))


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("file", type=Path, help="a lamp as .glb, .gltf, .obj, .usd, .usda, .usdc, .usdz or .xml")
    add("--output", type=Path, required=True, metavar="FOLDER")
    add("--picture", action=argparse.BooleanOptionalAction, default=True,
        help="render a portrait of the lamp")  # fmt: skip
    options.add(parser)
    return parser


def _import(arguments: argparse.Namespace) -> int:
    from purelight_import.importing import import_lamp
    from purelight_import.write.folder import TEXT

    made = import_lamp(
        arguments.file, arguments.output, options.Options.of(arguments), picture=arguments.picture
    )
    print(plain_lines((made.scene.parent / TEXT).read_text("utf-8")))
    tell(COMMAND, made.notes, made.doubts)
    scene = arguments.output / made.scene.name
    print(f"{scene}: next: purelight-train {scene} --output run")
    return 0


def tell(name: str, notes: Sequence[str], doubts: Sequence[str]) -> None:
    """Prints what was not taken as the file says, and what seems wrong."""
    for line in notes:
        command.note(name, line)
    for line in doubts:
        command.warn(name, line)


def plain_lines(text: str) -> str:
    """A text of several lines that is fit to be shown: nothing of it can steer a terminal."""
    return "\n".join(plain(line, 4096) for line in text.splitlines())
