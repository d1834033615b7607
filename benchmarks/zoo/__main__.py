"""Random lamps from a seed, each traced, trained, exported, validated, rendered and measured.

python -m benchmarks.zoo --output out/zoo --lamps 40 --seed 1 [--preset draft] [--only 3 7]
    [--jobs 2] [--stages make] [--again room] [--published] [--publish]

Every lamp has a process and a folder of its own, OUTPUT/SEED/LAMP: its scene, portrait, run and
bundle, figures.json, log.txt, and sheet.png: its portrait, three views through a lens, two before
a bright panel and a room, each as truth, ours and difference. Tables of all lamps are printed and
written to OUTPUT/SEED/zoo.md and zoo.json, with their portraits in zoo.png. A later call does only
what is missing; --again does the stages that it names once more (after the code has changed), or
those that failed. --publish copies tables and figures to benchmarks/results/zoo, and --published
takes from there what was measured before, on any machine.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from benchmarks.zoo import published, sheet, table
from benchmarks.zoo.record import PORTRAIT, STAGES, Record
from benchmarks.zoo.runner import Job, Limits, jobs_of, run
from benchmarks.zoo.settings import settings
from purelight_format import atomic, command

PICTURES = (PORTRAIT, "appearance.png", "transmittance.png", "room.png")


def main() -> int:
    """Run the zoo; returns 0, also if lamps failed."""
    _zoo(_parser().parse_args())
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog="python -m benchmarks.zoo", description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/zoo"))
    add("--lamps", type=command.whole(1), default=40, help="how many")
    add("--seed", type=command.seed, default=1)
    add("--preset", default="draft", help="of the training; tiny tries the machinery alone")
    add("--only", type=command.whole(0), nargs="+", metavar="N", help="numbers of the lamps to run")
    add("--jobs", type=command.whole(1), default=2, help="lamps side by side")
    add("--threads", type=command.whole(1), default=1, help="of each lamp")
    add("--stages", nargs="+", choices=STAGES, default=list(STAGES))
    add("--again", nargs="+", choices=(*STAGES, "failed"), default=[], metavar="STAGE")
    add("--published", action="store_true", help="go on from the figures in the repository")
    add("--publish", action="store_true", help="put tables and figures into the repository")
    add("--limit", type=command.number(0), default=3600, help="seconds of one lamp")
    add("--memory", type=command.number(0), default=8, help="GiB of one lamp")
    return parser


def _zoo(arguments: argparse.Namespace) -> None:
    settings(arguments.preset)  # an unknown one is refused before anything is made
    indices = arguments.only or list(range(arguments.lamps))
    jobs = jobs_of(
        arguments.output, arguments.seed, indices, arguments.preset, arguments.stages,
        arguments.threads,
    )  # fmt: skip
    for job in jobs:
        if not (arguments.published and published.recall(job)):
            job.prepare(arguments.again)
    limits = Limits(arguments.limit, arguments.memory * 2**30)
    for done, job in enumerate(run(jobs, limits, arguments.jobs), 1):
        print(f"[{done}] {job.lamp.name}: {_state(job)}", file=sys.stderr, flush=True)
    folder = arguments.output / str(arguments.seed)
    print(report(folder))
    if arguments.publish:
        published.publish(folder)


def _state(job: Job) -> str:
    record = Record.open(job.folder)
    troubles = table.unmeasured(record)
    return record.stopped or "; ".join(f"{k}: {v}" for k, v in troubles.items()) or "done"


def report(folder: Path) -> str:
    """Write the tables and the gallery of all lamps in a seed's folder; returns the tables."""
    records = {
        path.parent.name: Record.open(path.parent) for path in sorted(folder.glob("*/figures.json"))
    }
    text = table.markdown(records)
    atomic.write_bytes(folder / "zoo.md", text.encode())
    data = json.dumps(table.summary(records), indent=2) + "\n"
    atomic.write_bytes(folder / "zoo.json", data.encode())
    portraits = {n: folder / n / PORTRAIT for n in records}
    known = {n: file for n, file in portraits.items() if file.is_file()}
    for name in records:
        sheet.stacked(folder / name / "sheet.png", [folder / name / file for file in PICTURES])
    if known:
        sheet.gallery(folder / "zoo.png", known)
    return text


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.zoo", main))
