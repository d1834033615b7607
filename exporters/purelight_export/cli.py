"""`purelight-export`: a training run becomes a `.plux` bundle."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from purelight_export.choices import IES, NETWORKS, PHOTOMETRIC
from purelight_export.siblings import left_over
from purelight_format import command

COMMAND = "purelight-export"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _export(_parser().parse_args(argv)))


def _export(options: argparse.Namespace) -> int:
    from purelight_export.export import export  # Not before the options are right: it is slow.

    written = export(
        options.run, options.output, networks=options.networks,
        compact=options.precision == "compact", name=options.name, lumens=options.lumens,
        photometry=options.photometry, issued=options.issued,
    )  # fmt: skip
    for path in written:
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB")
    for path in left_over(written):
        command.warn(COMMAND, f"{path}: of an earlier export, is not written anew; remove it")
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("run", type=Path, help="a run directory of purelight-train")
    add("--output", type=Path, required=True, help="lamp.plux; .usda and .ies go beside it")
    add("--networks", type=_networks, default=NETWORKS, help=",".join(NETWORKS))
    add("--photometry", type=_photometry, default=(IES,), metavar="KINDS",
        help=f"photometric files to write beside it: {','.join(PHOTOMETRIC)}")  # fmt: skip
    add("--precision", choices=("fp32", "compact"), default="fp32",
        help="compact: grid tables of 15 bits, half their size")  # fmt: skip
    add("--name", help="name of the lamp (default: that of its scene)")
    add(
        "--lumens",
        type=command.number(0),
        metavar="LM",
        help="luminous flux to scale the lamp to (default: as traced)",
    )
    add("--issued", type=command.day, metavar="YYYY-MM-DD",
        help="date in photometric files (default: the day the run was finished)")  # fmt: skip
    return parser


def _networks(text: str) -> tuple[str, ...]:
    return _chosen(text, NETWORKS, "network")


def _photometry(text: str) -> tuple[str, ...]:
    return _chosen(text, PHOTOMETRIC, "photometric file")


def _chosen(text: str, choices: Sequence[str], what: str) -> tuple[str, ...]:
    """The names in a list with commas, each once."""
    chosen = tuple(dict.fromkeys(filter(None, text.split(","))))
    unknown = [name for name in chosen if name not in choices]
    if unknown:
        raise argparse.ArgumentTypeError(f"no {what} {unknown[0]!r}; choose from {choices}")
    return chosen
