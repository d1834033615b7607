"""Fuzzing by numbers: python -m tests.fuzz --count 10000000, or --seconds 3600."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from tests.fuzz import harness
from tests.fuzz.harness import Tally
from tests.fuzz.targets import TARGETS


def main() -> int:
    """Runs the targets in turn; 1 if anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--target", choices=TARGETS, action="append", help="default: all")
    parser.add_argument("--count", type=int, default=2**40, help="inputs over all targets")
    parser.add_argument("--seconds", type=float, default=60, help="for all targets")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0, help="another one, other inputs")
    parser.add_argument("--summary", type=Path, help="JSON of counts, added to if it is there")
    parser.add_argument("--findings", type=Path, default=Path("out/fuzz"))
    options = parser.parse_args()
    names = options.target or list(TARGETS)
    whole = sum(TARGETS[name].share for name in names)
    tallies: dict[str, Tally] = {}
    for name in names:
        count = max(1, int(options.count * TARGETS[name].share / whole))
        tallies[name] = harness.run(
            name, count, options.seconds / len(names),
            processes=options.processes, seed=options.seed,
        )  # fmt: skip
        print(_line(name, tallies[name]), flush=True)
        if options.summary:
            _add(options.summary, name, tallies[name])
    found = [item for tally in tallies.values() for item in tally.findings]
    if found:
        harness.save(found, options.findings)
    print(f"{sum(t.inputs for t in tallies.values()):,} inputs, {len(found)} findings")
    return 1 if found else 0


def _line(name: str, tally: Tally) -> str:
    rate = tally.inputs / max(tally.seconds, 1e-9)
    return (
        f"{name:<12}{tally.inputs:>12,} inputs{tally.accepted:>10,} accepted{rate:>9,.0f} /s"
        f"{tally.slowest * 1e3:>8.0f} ms slowest{tally.megabytes:>6} MB"
        f"{len(tally.findings):>4} findings"
    )


def _add(path: Path, name: str, tally: Tally) -> None:
    """Adds a target's counts to the summary, so that a run cut off has not been for nothing."""
    known = json.loads(path.read_text()) if path.exists() else {}
    total = Tally(**known.get(name, {}))
    total.add(tally)
    path.write_text(json.dumps(known | {name: asdict(total)}, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
