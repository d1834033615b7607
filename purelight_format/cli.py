"""`purelight-validate` and `purelight-inspect`."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from purelight_format import command
from purelight_format.bundle import Bundle
from purelight_format.members import strict_json
from purelight_format.summary import summary_json, summary_text
from purelight_format.validation.validate import validate


def validate_main(argv: Sequence[str] | None = None) -> int:
    """Checks bundles: 0 if all are valid, 1 if one is not, 2 if one could not be read."""
    return _run("purelight-validate", "Checks that a .plux bundle is valid.", _validate, argv)


def inspect_main(argv: Sequence[str] | None = None) -> int:
    """Says what a bundle is: 0, or 2 if it is not valid or could not be read."""
    return _run("purelight-inspect", "Says what a .plux bundle holds.", _inspect, argv)


def _run(
    name: str,
    description: str,
    action: Callable[[argparse.Namespace], int],
    argv: Sequence[str] | None,
) -> int:
    parser = command.Parser(prog=name, description=description)
    parser.add_argument("bundle", type=Path, help="lamp.plux")
    parser.add_argument("--json", action="store_true", help="for programs")
    return command.run(name, lambda: action(parser.parse_args(argv)))


def _validate(options: argparse.Namespace) -> int:
    report = validate(options.bundle)
    path = str(options.bundle)
    print(report.to_json(path) if options.json else report.to_text(path))
    return report.exit_code


def _inspect(options: argparse.Namespace) -> int:
    bundle = Bundle.open(options.bundle)
    if options.json:
        print(strict_json.shown(summary_json(bundle)))
    else:
        print(summary_text(bundle))
    return 0
