"""What only an NVIDIA GPU can show, in one command.

python -m benchmarks.cuda [--lamp lamp.plux] [--output out/bench] [--variant cuda_ad_rgb]
    [--checks ray networks ...]

Prints a row per check and writes OUTPUT/VARIANT.json. The exit code is 0 if every check of
correctness passed, 1 if one failed, and 2 where the variant does not run at all. Each check has
processes of its own, so that a crash is one failed row.

Dense layers have half precision on CUDA, and golden vectors are for single precision. What counts
for them is the same rule with the rounding of half precision: the vector's tolerance, and 8 times
the largest effect of other roundings of the weights. Pictures of half networks may differ by
`HALF_LIGHT` from those of single ones, besides noise.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from benchmarks.cuda import isolated, lamp
from benchmarks.cuda.checks import FAIL, REFERENCE, Row, Subject, run
from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError

COMMAND = "benchmarks.cuda"


def main(words: Sequence[str] | None = None) -> int:
    """Makes the checks, prints the table and writes OUTPUT/VARIANT.json; 1 if one fails."""
    return command.run(COMMAND, lambda: _act(_options(words)))


def _options(words: Sequence[str] | None) -> argparse.Namespace:
    parser = command.Parser(prog=f"python -m {COMMAND}", description=__doc__)
    add = parser.add_argument
    add("--lamp", type=Path, help="a .plux bundle; default: a small one is made")
    add("--output", type=Path, default=Path("out/bench"))
    add("--variant", choices=("cuda_ad_rgb", REFERENCE), default="cuda_ad_rgb")
    add("--checks", nargs="+", default=[""], help="how their names begin")
    return parser.parse_args(words)


def _act(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory() as folder:
        path = arguments.lamp or lamp.write(Path(folder) / "small.plux")
        Bundle.open(path)
        return measure(Subject(arguments.variant, path.resolve()), arguments)


def measure(subject: Subject, arguments: argparse.Namespace) -> int:
    """Prints row after row, since some take a minute; returns the exit code."""
    isolated.call(subject.variant, "traced")
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = []
    for row in run(subject, arguments.checks):
        print(line(row), flush=True)
        rows.append(row)
    if not rows:
        raise PureLightError(f"no check begins with {' or '.join(arguments.checks)}")
    report = {"variant": subject.variant, "machine": machine(), "rows": [asdict(r) for r in rows]}
    file = arguments.output / f"{subject.variant}.json"
    atomic.write_bytes(file, (json.dumps(report, indent=2) + "\n").encode())
    failed = sum(row.verdict == FAIL for row in rows)
    print(f"{failed} of {len(rows)} failed; {file}")
    return 1 if failed else 0


def line(row: Row) -> str:
    """A row of the table."""
    return f"{row.check:36}{row.verdict:10}{row.figure}"


def machine() -> dict[str, str]:
    """The libraries, and the GPU and its driver where there is one."""
    found = {name: version(name) for name in ("mitsuba", "drjit")}
    if shutil.which("nvidia-smi"):
        query = ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"]
        found["gpu"] = subprocess.run(query, capture_output=True, text=True).stdout.strip()  # noqa: PLW1510
    return found


if __name__ == "__main__":
    sys.exit(main())
