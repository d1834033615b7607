"""`purelight-conformance`: make the suite, and put it to a host."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from purelight_conformance import maker, runner, suite, text
from purelight_conformance.suite import Suite
from purelight_format import command
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError

COMMAND = "purelight-conformance"
LONGEST = 1_000_000  # Seconds to wait for an answer; the system's clocks take no more than some.


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command: 0 if the host conforms, 1 if not, 2 if that could not be found out."""
    return command.run(COMMAND, lambda: _act(_parser().parse_args(argv)))


def _act(options: argparse.Namespace) -> int:
    return _make(options) if options.action == "make" else _run(options)


def _make(options: argparse.Namespace) -> int:
    made = maker.make(options.folder)
    vectors = sum(map(len, made.sets))
    print(
        f"{options.folder}: {vectors} vectors in {len(made.sets)} sets, {len(made.bundles)} files"
    )
    return 0


def _run(options: argparse.Namespace) -> int:
    if not 0 < options.timeout <= LONGEST:
        raise PureLightError(f"--timeout must be above 0 s and at most {LONGEST:,} s")
    bundles = [Bundle.open(path) for path in dict.fromkeys(options.bundles)]
    stems = [bundle.path.stem for bundle in bundles]
    with tempfile.TemporaryDirectory() as folder:
        wanted = suite.read(options.suite) if options.suite else maker.make(Path(folder))
        for bundle in bundles:
            alone = stems.count(bundle.path.stem) == 1
            wanted = wanted + maker.of_bundle(bundle, "" if alone else str(bundle.path))
        report = _watched(wanted, options)
    print(text.to_json(report) if options.json else text.to_text(report))
    return 0 if report.conforms else 1


def _watched(wanted: Suite, options: argparse.Namespace) -> runner.Report:
    """Runs with a line of progress where somebody watches."""
    watched = sys.stderr.isatty()

    def progress(done: int, total: int, name: str) -> None:
        if watched:
            print(f"\r\033[K{done}/{total} {name}", end="", file=sys.stderr, flush=True)

    try:
        return runner.run(wanted, options.host, timeout=options.timeout, progress=progress)
    finally:
        if watched:
            print("\r\033[K", end="", file=sys.stderr)


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description="Checks hosts of PureLight bundles.")
    actions = parser.add_subparsers(dest="action", required=True)
    make = actions.add_parser("make", help="write the suite to a folder")
    make.add_argument("folder", type=Path)
    run = actions.add_parser("run", help="put the suite to a host")
    run.add_argument("bundles", nargs="*", type=Path, help="bundles whose own vectors to add")
    run.add_argument("--host", required=True, help="the host's command line")
    run.add_argument("--suite", type=Path, help="a folder that `make` wrote (default: made anew)")
    run.add_argument(
        "--timeout", type=float, default=120.0, help="seconds that one answer may take"
    )
    run.add_argument("--json", action="store_true", help="for programs")
    return parser


if __name__ == "__main__":
    sys.exit(main())
