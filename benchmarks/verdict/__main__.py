"""Verdicts of lamps beside an independent truth.

python -m benchmarks.verdict --output out/verdict FOLDER [FOLDER ...] [--paths 8388608]

A folder is one of the zoo, of the demo, or any that has a lamp's scene in it (lamp/*.xml or
luminaire/*.xml), its run (`run`) and bundle (`lamp.plux`). A run without a verdict gets one. What
was found is kept in OUTPUT/NAME.json, so that a later call makes only what is missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from purelight_format import atomic, command
from purelight_format.errors import PureLightError
from purelight_format.verdict.figures import Verdict, read
from purelight_mitsuba import platform


def main() -> int:
    """Measure, and print a table."""
    parser = command.Parser(prog="python -m benchmarks.verdict", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--output", type=Path, default=Path("out/verdict"))
    parser.add_argument("--paths", type=command.whole(1), default=1 << 23, help="of the truths")
    parser.add_argument("--spp", type=command.whole(1), default=1 << 10, help="of a rendered cell")
    parser.add_argument("--threads", type=command.whole(1), default=2)
    print(_table(parser.parse_args()))
    return 0


def _table(arguments: argparse.Namespace) -> str:
    mi = platform.use()
    mi.set_log_level(mi.LogLevel.Error)
    import drjit as dr

    import purelight_mitsuba
    from benchmarks.verdict.table import markdown, row
    from benchmarks.verdict.truth import Effort
    from purelight_train import threads

    purelight_mitsuba.register()
    threads.use(arguments.threads)
    dr.set_thread_count(arguments.threads)
    effort = Effort(arguments.paths, arguments.paths, arguments.spp)
    rows = []
    for folder in arguments.folders:
        name = folder.resolve().name
        data = measured(folder, arguments.output / f"{name}.json", effort)
        stated = read(data["said"])
        assert stated is not None
        rows.append(row(name, stated, data["found"]))
        print("| " + " | ".join(rows[-1]) + " |", file=sys.stderr, flush=True)
    return markdown(rows)


def measured(folder: Path, kept: Path, effort: Any) -> dict[str, Any]:
    """A lamp's verdict, and the truth about it; what is kept already is not measured again.

    Raises:
        PureLightError: its scene, run or bundle is missing.
    """
    from benchmarks.verdict.truth import found
    from tests.support.fidelity import Subject

    scenes = sorted([*folder.glob("lamp/*.xml"), *folder.glob("luminaire/*.xml")])
    if not scenes or not (folder / "lamp.plux").is_file():
        raise PureLightError(f"{folder}: no lamp/*.xml with run and lamp.plux beside it")
    subject = Subject(scenes[0], folder / "run", folder / "lamp.plux")
    atomic.check_file(kept)
    data = json.loads(kept.read_text()) if kept.is_file() else {}
    makers = {"said": lambda: said(subject).to_json(), "found": lambda: found(subject, effort)}
    for name, make in makers.items():
        if name not in data:
            data[name] = make()
            atomic.write_bytes(kept, (json.dumps(data, indent=2) + "\n").encode())
    return data


def said(subject: Any) -> Verdict:
    """The run's verdict, measured now if it has none."""
    from purelight_train.runs import judging
    from purelight_train.runs.pipeline import reopen
    from purelight_train.runs.run_directory import RunDirectory

    run = RunDirectory.open(subject.run)
    stated = read(run.read_json("metrics.json").get("verdict"))
    if stated is not None:
        return stated
    training = reopen(run, subject.scene)
    return judging.verdict(training, training.judge)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.verdict", main))
