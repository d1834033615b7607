"""`purelight-catalogue`: many lamps trained, exported and judged, and a page of them all."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from purelight_catalogue.catalogue import Card, gather
from purelight_catalogue.engine import engine, run
from purelight_catalogue.entries import Entry, read_entries
from purelight_catalogue.index import write_index
from purelight_catalogue.jobs import NEEDED, Job, Settings, check_presets, jobs_of
from purelight_catalogue.page import write_page
from purelight_catalogue.progress import Progress
from purelight_catalogue.results import Results
from purelight_catalogue.usd_stage import write_stage
from purelight_catalogue.work import Outcome
from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_train.presets import PRESETS

COMMAND = "purelight-catalogue"
SOME_FAILED = 1


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; 0, 1 if a lamp failed, 2 after a one-line error."""
    return command.run(COMMAND, lambda: _catalogue(_parser().parse_args(argv)))


def _catalogue(options: argparse.Namespace) -> int:
    entries = read_entries(options.lamps)
    if unknown := check_presets(entries, options.preset):
        raise PureLightError(f"no preset {unknown[0]}; choose from {' '.join(sorted(PRESETS))}")
    atomic.check_folder(options.output)
    results = Results((options.output / "results").absolute())
    results.sweep()
    settings = Settings(
        options.preset, options.seed, options.target_error, photons=options.photons,
        device=options.device, issued=options.issued or results.begun(),
    )  # fmt: skip
    work, faults = _plan(entries, settings)
    mine = _shard(work, options.shard)
    outcomes = _do(mine, results, options)
    if options.shard:
        broken = [outcome.job.stage for outcome in outcomes.values() if outcome.fault]
        part = "/".join(map(str, options.shard))
        print(f"shard {part}: {len(mine)} lamps, {len(broken)} jobs failed; once all shards are "
              "done, run the command without --shard for the page")  # fmt: skip
        return SOME_FAILED if set(broken) & set(NEEDED) else 0
    cards = [
        gather(entry, work[entry.name], outcomes, results, options.output)
        if entry.name in work
        else Card(entry, faults[entry.name], {}, {}, 0.0, 0.0)
        for entry in entries
    ]
    return _write(cards, options.output)


def _plan(
    entries: Sequence[Entry], settings: Settings
) -> tuple[dict[str, list[Job]], dict[str, str]]:
    """The jobs of each lamp, and why others have none."""
    work, faults = dict[str, list[Job]](), dict[str, str]()
    for entry in entries:
        try:
            work[entry.name] = jobs_of(entry, settings)
        except (PureLightError, OSError, ValueError) as error:  # Of names that no system has
            faults[entry.name] = str(error)
    return work, faults


def _shard(work: dict[str, list[Job]], shard: tuple[int, int] | None) -> dict[str, list[Job]]:
    """Every n-th lamp, from the i-th on."""
    if not shard:
        return work
    chosen = list(work)[shard[0] - 1 :: shard[1]]
    return {name: work[name] for name in chosen}


def _do(
    work: dict[str, list[Job]], results: Results, options: argparse.Namespace
) -> dict[str, Outcome]:
    """Do what has no result yet; how each job ended, by key."""
    jobs = {job.key: job for of_lamp in work.values() for job in of_lamp}
    found = {key: Outcome(job, "", False, done.seconds, done.gibibytes, 0, done.host)
             for key, job in jobs.items() if (done := results.done(job))}  # fmt: skip
    missing = [job for key, job in jobs.items() if key not in found]
    if found:
        print(f"{len(found)} of {len(jobs)} jobs were done before", file=sys.stderr)
    if not missing:
        return found
    logs = options.output.absolute() / "logs"
    with engine(options.workers, options.scheduler) as client:
        if options.scheduler and (link := client.dashboard_link):
            print(f"dashboard: {link}", file=sys.stderr)
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
        progress = Progress(missing, workers)
        for outcome in run(client, missing, results.folder, logs):
            found[outcome.job.key] = outcome
            progress.ended(outcome)
    return found


def _write(cards: Sequence[Card], output: Path) -> int:
    failed = [card for card in cards if card.fault]
    index, page = write_index(cards, output), write_page(cards, output)
    stage = write_stage(cards, output)
    for card in cards:
        for line in [card.fault] if card.fault else card.warnings:
            command.warn(COMMAND, f"{card.entry.name}: {line}")
    others = f"{index.name} and {stage.name}" if stage else index.name
    print(f"{len(cards) - len(failed)} lamps, {len(failed)} failed; look at {page}; also {others}")
    return SOME_FAILED if failed else 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("lamps", type=Path, help="a folder of lamps, or a table of them (.csv, .jsonl)")
    add("--output", type=Path, required=True, help="folder of the catalogue; what is there is kept")
    add("--preset", choices=sorted(PRESETS), default="draft", help="of all lamps without one")
    add("--seed", type=int, default=0)
    add("--target-error", type=command.number(0, 1), metavar="E",
        help="the smallest networks within this error, as purelight-size finds them")  # fmt: skip
    add("--photons", type=_photons, default=0, metavar="N",
        help="trace as many besides, in parts, for flux, far field and a picture")  # fmt: skip
    add("--issued", type=command.day, metavar="YYYY-MM-DD",
        help="date in photometric files (default: the day the catalogue was begun)")  # fmt: skip
    add("--device", choices=("cpu", "cuda"), default="cpu", help="of training")
    add("--workers", type=_count, default=os.cpu_count() or 1,
        help="jobs side by side on this machine, a core each")  # fmt: skip
    add("--scheduler", metavar="ADDRESS", help="of Dask workers elsewhere, as tcp://10.0.0.1:8786; "
        "they must see the folders under the same names")  # fmt: skip
    add("--shard", type=_part, metavar="I/N",
        help="every N-th lamp from the I-th on, for schedulers of other kinds")  # fmt: skip
    return parser


def _count(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"{text}: give a number from 1 to 4096")
    return int(text)


def _photons(text: str) -> int:
    count = command.number(0, 1e13)(text)
    return int(count)


def _part(text: str) -> tuple[int, int]:
    first, _, second = text.partition("/")
    if not (first.isdigit() and second.isdigit() and 1 <= int(first) <= int(second)):
        raise argparse.ArgumentTypeError(f"{text}: give a part such as 2/8")
    return int(first), int(second)


if __name__ == "__main__":
    raise SystemExit(main())
