"""One lamp of the zoo, from its making to its figures, in a process of its own.

python -m benchmarks.zoo.worker SEED INDEX FOLDER [--preset draft] [--stages ...] [--threads 1]

Stages that `FOLDER/figures.json` holds already are left out. What a stage says of a lamp that it
cannot do becomes one line there.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from benchmarks.zoo.lamps.lamp import Lamp, make
from benchmarks.zoo.record import NEEDED, PORTRAIT, STAGES, Record, code_digest
from benchmarks.zoo.settings import Settings, settings
from purelight_format import atomic
from purelight_format.errors import PureLightError

Figures = dict[str, Any]


@dataclass
class Worker:
    """The stages of one lamp.

    Arguments:
        folder: where everything of this lamp goes.
        threads: processor threads to use.
    """

    lamp: Lamp
    folder: Path
    settings: Settings
    threads: int = 1

    @property
    def scene(self) -> Path:
        return self.folder / "lamp" / "lamp.xml"

    @property
    def run_folder(self) -> Path:
        return self.folder / "run"

    @property
    def bundle(self) -> Path:
        return self.folder / "lamp.plux"

    @cached_property
    def case(self) -> Any:
        from benchmarks.zoo.figures.case import Case
        from benchmarks.zoo.figures.enlarged import Enlarged
        from tests.support.fidelity import Subject

        subject = Subject(self.scene, self.run_folder, self.bundle, self.threads)
        return Case(self.lamp, subject, Enlarged(self.lamp, self.folder / "large"), self.settings)

    def __call__(self, stages: list[str]) -> None:
        """Run the stages that have no result yet; a stage that others need ends it all."""
        record, code = Record.open(self.folder), code_digest()
        for name in (s for s in STAGES if s in stages and s not in record.stages):
            record.begin(name)
            print(f"== {name}", flush=True)
            start = time.process_time()
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                result = attempt(self.stage(name))
            said = [" ".join(str(w.message).split()) for w in caught if _telling(w)]
            record.warnings = list(dict.fromkeys([*record.warnings, *said]))
            seconds = round(time.process_time() - start, 1)  # Whatever else runs
            record.end(name, {"seconds": seconds, "code": code, **result})
            if name in NEEDED and "figures" not in result:
                break

    def stage(self, name: str) -> Callable[[], Figures]:
        """What makes the figures of a stage."""
        own = {
            "make": self._make, "train": self._train, "export": self._export,
            "validate": self._validate,
        }  # fmt: skip
        if name in own:
            return own[name]
        from benchmarks.zoo.figures.all import FIGURES

        return lambda: FIGURES[name](self.case)

    def _make(self) -> Figures:
        from benchmarks.zoo.lamps.look import portrait
        from purelight_format.srgb import png

        shutil.rmtree(self.scene.parent, ignore_errors=True)
        self.lamp.write(self.scene.parent)
        self.lamp.write_description(self.scene.parent)
        atomic.write_bytes(self.folder / PORTRAIT, png(portrait(self.lamp), -0.5))
        return self.lamp.description()

    def _train(self) -> Figures:
        """Trace and train; the preset may be one that the command does not offer by itself."""
        import purelight_train.cli
        from purelight_train.presets import PRESETS
        from purelight_train.runs.run_directory import RunDirectory

        PRESETS.setdefault(self.settings.preset.name, self.settings.preset)
        words = [
            str(self.scene), "--output", str(self.run_folder), "--resume", "--no-report",
            "--preset", self.settings.preset.name, "--threads", str(self.threads),
            "--device", "cpu",
        ]  # fmt: skip
        said = command(purelight_train.cli.main, words)
        metrics = RunDirectory.open(self.run_folder).read_json("metrics.json")
        keep = ("seconds", "flux", "flux_gain", "held_out_gain_nats", "dropped", "verdict")
        return {"said": said} | {name: metrics[name] for name in keep if name in metrics}

    def _export(self) -> Figures:
        import purelight_export.cli

        words = [str(self.run_folder), "--output", str(self.bundle)]
        said = command(purelight_export.cli.main, words)
        return {"megabytes": self.bundle.stat().st_size / 1e6, "said": said}

    def _validate(self) -> Figures:
        import purelight_format.cli

        return {"said": command(purelight_format.cli.validate_main, [str(self.bundle)])}


def attempt(work: Callable[[], Figures]) -> dict[str, Any]:
    """The figures of some work, or one line that says why there are none."""
    try:
        return {"figures": work()}
    except PureLightError as error:
        return {"refused": " ".join(str(error).split())}
    except Exception as error:  # a lamp must not take the others down with it
        traceback.print_exc()
        reason = " ".join(str(error).split())
        return {"failed": f"{type(error).__name__}: {reason[:200]}"}


def command(main: Callable[[list[str]], int], words: list[str]) -> str:
    """The last line that a command prints.

    Raises:
        PureLightError: it ends with another code than 0; what it said.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(words)
    text = said.getvalue().strip()
    print(text, flush=True)
    last = text.splitlines()[-1] if text else ""
    if code != 0:
        raise PureLightError(last.partition("error: ")[2] or last or f"exit code {code}")
    return last


def _telling(warning: warnings.WarningMessage) -> bool:
    """Whether a warning is one that our code wrote for the lamp's maker."""
    return issubclass(warning.category, UserWarning)


def main() -> int:
    """Run one lamp; its folder's record says how it went."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.zoo.worker", description=__doc__)
    parser.add_argument("seed", type=int)
    parser.add_argument("index", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=list(STAGES))
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    from purelight_mitsuba import use

    mi = use()
    mi.set_log_level(mi.LogLevel.Error)
    import drjit as dr

    dr.set_thread_count(arguments.threads)
    lamp = make(arguments.seed, arguments.index)
    chosen = settings(arguments.preset)
    Worker(lamp, arguments.folder, chosen, arguments.threads)(arguments.stages)
    return 0


if __name__ == "__main__":
    sys.exit(main())
