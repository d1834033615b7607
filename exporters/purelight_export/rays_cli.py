"""`purelight-rays`: the light of a bundle, a run or a ray file becomes a ray file."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from purelight_format import atomic, command
from purelight_format.ray_file.files import SUFFIXES, require_name, write_ray_file

COMMAND = "purelight-rays"
MOST = 1e9


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _rays(_parser().parse_args(argv)))


def _rays(options: argparse.Namespace) -> int:
    require_name(options.output)
    atomic.check_file(options.output)
    if options.source.is_dir():
        from purelight_mitsuba import platform

        platform.use()
    from purelight_export.rays import rays_file, scaled_to, summary

    count = options.count
    with tqdm(total=count, desc="rays", unit="ray", unit_scale=True, delay=1) as bar:
        file = rays_file(options.source, count, options.seed, lambda n: bar.update(n - bar.n))
    for note in (*file.notes, *file.flux_notes()):
        command.warn(COMMAND, f"{options.source}: {note}")
    if options.lumens:
        file = scaled_to(file, options.lumens)
    write_ray_file(options.output, file)
    print(summary(file, options.output))
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("source", type=Path, help="lamp.plux, a run of purelight-train, or a ray file")
    add("--output", type=Path, required=True, help=f"a name in {', '.join(SUFFIXES)}")
    add("--count", type=_count, metavar="N",
        help="rays (default: a million; of a ray file, all)")  # fmt: skip
    add("--lumens", type=command.number(0), metavar="LM", help="luminous flux to scale them to")
    add("--seed", type=command.seed, default=0)
    return parser


def _count(text: str) -> int:
    """How many rays, 1e6 as well as 1000000."""
    value = command.number(0, MOST)(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: give at least 1")
    return int(value)
