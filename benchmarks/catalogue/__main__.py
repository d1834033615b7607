"""What `purelight-catalogue` saves and survives.

python -m benchmarks.catalogue --output out/catalogue [--lamps 60] [--preset sketch] [--seed 1]
    [--trials speed faults broken thousands] [--thousands 10000]

`speed`: lamps of the zoo by one worker and by two, one after the other: seconds, memory of all
processes, digests. `faults`: the same by a scheduler and two workers in processes of their own; a
worker is killed three times and the scheduler once, and the command begun again: what was done
twice, and the digests beside those of `speed`. `broken`: a few lamps with ten broken ones among
them, and what is said of each. `thousands`: what the catalogue itself takes where every lamp is
there already. Results are OUTPUT/catalogue-trials.json.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from benchmarks.catalogue.faults import Blows, Cluster, digests
from benchmarks.catalogue.lamps import write_broken, write_lamps, write_table
from benchmarks.catalogue.thousands import thousands
from benchmarks.catalogue.watch import catalogue, watch
from purelight_format import atomic, command

TRIALS = ("speed", "faults", "broken", "thousands")
WORKERS = 2
FEW = 3
Figures = dict[str, Any]


def main() -> int:
    """Run the trials; 0, 1 if one did not end as it ought to."""
    parser = command.Parser(prog="python -m benchmarks.catalogue", description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/catalogue"))
    add("--lamps", type=command.whole(1), default=60)
    add("--seed", type=command.seed, default=1, help="of the zoo")
    add("--preset", default="sketch")
    add("--trials", nargs="+", choices=TRIALS, default=TRIALS)
    add("--thousands", type=command.whole(1), default=10_000, help="lamps that are there already")
    options = parser.parse_args()
    good = [_trial(name, options) for name in TRIALS if name in options.trials]
    return 0 if all(good) else 1


def _trial(name: str, options: argparse.Namespace) -> bool:
    folder, report = options.output / name, options.output / "catalogue-trials.json"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    figures = {"speed": speed, "faults": faults, "broken": broken, "thousands": _thousands}[name](
        folder, options
    )
    known = json.loads(report.read_text()) if report.is_file() else {}
    asked = {"lamps": options.lamps, "preset": options.preset, "seed": options.seed}
    known[name] = asked | figures
    atomic.write_bytes(report, (json.dumps(known, indent=1) + "\n").encode())
    print(f"{name}: {json.dumps(figures, indent=1)}")
    return bool(figures["as it ought to be"])


def speed(folder: Path, options: argparse.Namespace) -> Figures:
    """One worker against two."""
    table = _table(folder, options)
    figures: Figures = {}
    found = {}
    for workers in (1, WORKERS):
        output = folder / f"{workers}"
        words = [table, "--output", str(output), "--preset", options.preset,
                 "--workers", str(workers)]  # fmt: skip
        ended = watch(catalogue(words, folder / f"{workers}.txt"))
        found[workers] = digests(output)
        figures[f"workers {workers}"] = {
            "seconds": round(ended.seconds, 1), "gibibytes": round(ended.gibibytes, 2),
            "lamps": len(found[workers]), "exit code": ended.code,
        }  # fmt: skip
    one, two = (figures[f"workers {n}"]["seconds"] for n in (1, WORKERS))
    same = found[1] == found[WORKERS]
    return figures | {"times less": round(one / two, 2), "as it ought to be": same}


def faults(folder: Path, options: argparse.Namespace) -> Figures:
    """Workers and a scheduler that are killed."""
    table = _table(folder, options)
    output, log = folder / "catalogue", folder / "log.txt"
    cluster = Cluster(folder / "dask.txt", WORKERS)
    jobs = 4 * options.lamps
    blows = Blows(
        cluster, output / "results", [max(1, jobs * k // 8) for k in (1, 2, 5)], jobs * 3 // 8
    )
    codes = []
    try:
        for _ in range(3):
            cluster.start()
            words = [table, "--output", str(output), "--preset", options.preset,
                     "--scheduler", cluster.address]  # fmt: skip
            codes.append(watch(catalogue(words, log), blows).code)
            if codes[-1] != 2:
                break
    finally:
        cluster.stop()
    twice, found = blows.done_twice(), digests(output)
    reference = options.output / "speed" / "1"
    known = digests(reference) if (reference / "catalogue.json").is_file() else {}
    both = [name for name in found if name in known]
    same = all(found[name] == known[name] for name in both) if both else None
    return {
        "blows": blows.told, "exit codes": codes, "lamps": len(found), "done twice": twice,
        "digests as by one worker": same, "compared": len(both),
        "as it ought to be": len(blows.told) == 4 and not twice and same is not False
        and codes[-1] != 2,
    }  # fmt: skip


def _table(folder: Path, options: argparse.Namespace) -> str:
    """Lamps of the zoo, and a table of them."""
    names = write_lamps(folder / "lamps", options.lamps, options.seed)
    return str(write_table(folder / "lamps", names))


def broken(folder: Path, options: argparse.Namespace) -> Figures:
    """A few lamps, and ten that are broken."""
    names = write_lamps(folder / "lamps", FEW, options.seed)
    wrong = write_broken(folder / "lamps")
    words = [str(folder / "lamps"), "--output", str(folder / "catalogue"), "--preset",
             options.preset, "--workers", str(WORKERS)]  # fmt: skip
    ended = watch(catalogue(words, folder / "log.txt"))
    data = json.loads((folder / "catalogue" / "catalogue.json").read_text())
    reasons = {one["name"]: one["fault"] for one in data["failed"]}
    there = {lamp["name"] for lamp in data["lamps"]}
    return {
        "exit code": ended.code, "lamps": sorted(there), "failed": reasons,
        "as it ought to be": ended.code == 1 and there == set(names)
        and set(reasons) == set(wrong) and all(reasons.values()),
    }  # fmt: skip


def _thousands(folder: Path, options: argparse.Namespace) -> Figures:
    """More lamps than anyone makes for a trial."""
    return thousands(folder, options.thousands, options.seed, options.preset)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.catalogue", main))
