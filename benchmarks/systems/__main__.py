"""Every system on the same lamps and tasks: speed against error, side by side.

python -m benchmarks.systems --output out/systems --scale smoke|small|full [--lamps ...]
    [--systems ...] [--tasks ...] [--threads 1] [--again NAME ... | failed]
    [--workers 2 | --scheduler tcp://HOST:8786]
python -m benchmarks.systems --output out/systems --scale smoke --report [--publish]
python -m benchmarks.systems --output out/systems --scale full --plan

Lamps of the gallery are trained where no run is there, truths are light traced, and every system
renders every task that it can do at growing counts of samples. What is measured is written to
OUTPUT/SCALE/LAMP/records.jsonl line by line, and a later call goes on from there. Lamps may be
measured side by side, as jobs of Dask; their seconds then are those of a busy machine. The report
(tables, fronts, pictures, verdicts on the paper's claims, one HTML page) is made of the records
alone, at the end of a run or by --report; --publish puts it into benchmarks/results/SCALE as well.
--plan measures nothing: it tells how many hours a scale would take, by what OUTPUT has of another.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.systems.own import OWN
from benchmarks.systems.protocol import System
from benchmarks.systems.scales import ANY_LAMP, SCALES, scale
from purelight_examples.luminaires.catalog import CATALOG
from purelight_format import command
from purelight_format.errors import PureLightError

COMMAND = "python -m benchmarks.systems"
RESULTS = Path(__file__).parents[1] / "results"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0, also if systems failed, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _act(_options(argv)))


def _parser() -> command.Parser:
    parser = command.Parser(
        prog=COMMAND, description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/systems"))
    add("--scale", choices=tuple(SCALES), default="smoke")
    add("--lamps", nargs="+", metavar="NAME", help="of the gallery; the scale's if not given")
    add(
        "--systems",
        nargs="+",
        metavar="NAME",
        help="all if not given; of smoke, those without training of their own",
    )
    add("--tasks", nargs="+", metavar="NAME", help="all if not given")
    add("--threads", type=command.whole(1), default=1, help="of training and of every system")
    add("--again", nargs="+", default=[], metavar="NAME", help="systems or tasks to measure once "
        "more, or failed")  # fmt: skip
    add("--workers", type=command.whole(0), default=0, metavar="N",
        help="lamps side by side on this machine")  # fmt: skip
    add("--scheduler", metavar="ADDRESS", help="of Dask workers elsewhere, as tcp://10.0.0.1:8786; "
        "started in a copy of this folder, they must see OUTPUT under the same name")  # fmt: skip
    add("--report", action="store_true", help="no measurement, only the report")
    add("--plan", action="store_true", help="no measurement, only the hours that it would take")
    add("--publish", action="store_true", help="write the report to benchmarks/results too")
    return parser


def measure(argv: Sequence[str]) -> int:
    """The measurement alone, without a report: what a job does."""
    return command.run(COMMAND, lambda: _measure(_options(argv)))


def _options(argv: Sequence[str] | None) -> argparse.Namespace:
    options = _parser().parse_args(argv)
    _check(options)
    return options


def _act(options: argparse.Namespace) -> int:
    folder = options.output / options.scale
    if options.plan:
        print(_plan(options))
        return 0
    if not options.report:
        if options.workers or options.scheduler:
            _side_by_side(options)
        else:
            _measure(options)
    from benchmarks.systems.report import report

    print(report.write(folder, systems(None), RESULTS / options.scale if options.publish else None))
    return 0


def _plan(options: argparse.Namespace) -> str:
    from benchmarks.systems.plan import plan

    if options.tasks:
        raise PureLightError("--plan is of all tasks; leave --tasks out")
    chosen = scale(options.scale)
    if options.lamps:
        chosen = replace(chosen, lamps=tuple(options.lamps))
    return plan(chosen, systems(options.systems or chosen.systems), options.output)


def _check(options: argparse.Namespace) -> None:
    """Raises PureLightError if there is nothing of a name that was given.

    A word that nobody knows would else be left out in silence, or measured as a lamp that fails.
    """
    chosen = scale(options.scale)
    tasks = [task.name for task in chosen.tasks(ANY_LAMP, 0.1)]
    names = [system.name for system in systems(None)]
    asked = (
        ("system", options.systems, names),
        ("task", options.tasks, tasks),
        ("system or task", options.again, [*names, *tasks, "failed"]),
        ("lamp", options.lamps, list(CATALOG)),
    )
    for what, words, known in asked:
        if unknown := set(words or ()) - set(known):
            where = " in this scale" if what == "task" else ""
            raise PureLightError(f"no {what} {min(unknown)}{where}; choose from {' '.join(known)}")


def _side_by_side(options: argparse.Namespace) -> None:
    from benchmarks.systems import cluster

    words = [f"--output={options.output.resolve()}", f"--scale={options.scale}",
             f"--threads={options.threads}"]  # fmt: skip
    for name in ("systems", "tasks", "again"):
        if values := getattr(options, name):
            words += [f"--{name}", *values]
    lamps = options.lamps or scale(options.scale).lamps
    for lamp, reason in cluster.run(lamps, words, options.workers, options.scheduler).items():
        command.warn(COMMAND, f"{lamp}: {reason}")


def _measure(options: argparse.Namespace) -> int:
    from benchmarks.systems.runner import Runner

    chosen = scale(options.scale)
    os.environ.update(OMP_NUM_THREADS=str(options.threads), OMP_WAIT_POLICY="PASSIVE")
    runner = Runner(
        options.output / options.scale, chosen, systems(options.systems or chosen.systems),
        options.threads, tuple(options.tasks or ()), tuple(options.again),
    )  # fmt: skip
    runner.run(options.lamps or chosen.lamps)
    return 0


def systems(names: Sequence[str] | None) -> list[System]:
    """Our own systems and the rivals, or those of some names.

    Raises:
        PureLightError: there is no such system.
    """
    from benchmarks.systems.rivals import RIVALS

    found: list[System] = [*OWN, *RIVALS]
    if names is None:
        return found
    known = {system.name: system for system in found}
    if unknown := set(names) - set(known):
        raise PureLightError(f"no system {min(unknown)}; choose from {' '.join(known)}")
    return [known[name] for name in known if name in names]


if __name__ == "__main__":
    sys.exit(main())
