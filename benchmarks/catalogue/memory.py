"""The memory that a training takes at its peak, beside what a catalogue's job asks for.

python -m benchmarks.catalogue.memory [--presets sketch draft standard] [--lamps 3] [--seed 2]

Each lamp of the zoo is trained by each preset in a process of its own, verdict included, with all
its samples, sizes and batches, but with `STEPS` steps of each optimisation: each step lets go of
what it took, and what photons are learned from is made anew a few times in so many.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.catalogue.lamps import write_lamps
from benchmarks.catalogue.watch import watch
from purelight_catalogue.jobs import TRAINING
from purelight_format import command
from purelight_train.device import begin
from purelight_train.presets import PRESETS

STEPS = 600


def main() -> int:
    """Print a table; 0, or 1 if a training failed or took more than a job asks for."""
    parser = command.Parser(prog="python -m benchmarks.catalogue.memory", description=__doc__)
    add = parser.add_argument
    add("--presets", nargs="+", choices=sorted(TRAINING), default=["sketch", "draft", "standard"])
    add("--lamps", type=command.whole(1), default=3)
    add("--seed", type=command.seed, default=2, help="of the zoo")
    options = parser.parse_args()
    good = True
    print("| preset | lamp | GiB at the peak | a job asks for |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in write_lamps(Path(folder), options.lamps, options.seed):
            for preset in options.presets:
                good &= _measured(Path(folder) / name, preset)
    return 0 if good else 1


def _measured(lamp: Path, preset: str) -> bool:
    """Train one lamp and print its row."""
    call = f"from benchmarks.catalogue.memory import train; train({str(lamp)!r}, {preset!r})"
    with open(lamp / f"{preset}.txt", "w") as log:
        ended = watch(subprocess.Popen([sys.executable, "-c", call], stdout=log, stderr=log))
    if ended.code:
        print(*(lamp / f"{preset}.txt").read_text().splitlines()[-1:], file=sys.stderr)
    took = "failed" if ended.code else f"{ended.gibibytes:.2f}"
    print(f"| `{preset}` | {lamp.name} | {took} | {TRAINING[preset]:g} |", flush=True)
    return not ended.code and ended.gibibytes <= TRAINING[preset]


def train(lamp: str, preset: str) -> None:
    """Train a lamp in this process, in few steps."""
    begin("cpu", 1)
    from purelight_train.runs.pipeline import start

    shortened = PRESETS[preset].with_steps(lambda steps: min(steps, STEPS))
    start(
        Path(lamp) / "lamp.xml", Path(lamp) / preset, shortened, 0, "cpu",
        resume=False, route="photons", anchor="auto",
    )()  # fmt: skip


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.catalogue.memory", main))
