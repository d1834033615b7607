"""Train lamps, export them, and print how near they are to the truth.

python -m benchmarks --output out/bench [--preset draft] [--lamps frosted_globe filament_bulb]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from purelight_format import atomic
from purelight_mitsuba import platform


def main() -> int:
    """Run the checks on the lamps; figures go to stdout and OUTPUT/fidelity-PRESET.json."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/bench"))
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--lamps", nargs="+", default=["frosted_globe", "filament_bulb"])
    parser.add_argument("--checks", nargs="+", help="some of flux irradiance appearance ...")
    arguments = parser.parse_args()
    results = {
        lamp: measure(lamp, arguments.output, arguments.preset, arguments.checks)
        for lamp in arguments.lamps
    }
    report = arguments.output / f"fidelity-{arguments.preset}.json"
    atomic.write_bytes(report, (json.dumps(results, indent=2) + "\n").encode())
    return 0


def measure(lamp: str, output: Path, preset: str, chosen: list[str] | None) -> dict[str, Any]:
    """Figures of every chosen check for one lamp."""
    subject, results = prepare(lamp, output, preset), {}
    from benchmarks.fidelity import CHECKS

    for name in chosen or list(CHECKS):
        start = time.monotonic()
        results[name] = CHECKS[name](subject)
        print(f"{lamp} {name} ({time.monotonic() - start:.0f} s): {json.dumps(results[name])}")
    return results


def prepare(lamp: str, output: Path, preset: str) -> Any:
    """Build, train and export a lamp, or take what an earlier call left."""
    import purelight_train.cli

    run, bundle = output / f"{lamp}-{preset}", output / f"{lamp}-{preset}.plux"
    scene = import_module(f"purelight_examples.luminaires.{lamp}").write(output / "lamps")
    words = [str(scene), "--output", str(run), "--preset", preset, "--resume"]
    if not bundle.is_file() and purelight_train.cli.main(words) != 0:
        sys.exit(2)
    platform.use()
    import purelight_export.cli
    import purelight_mitsuba
    from benchmarks.fidelity import Subject

    purelight_mitsuba.register()
    if not bundle.is_file() and purelight_export.cli.main([str(run), "--output", str(bundle)]):
        sys.exit(2)
    return Subject(scene, run, bundle)


if __name__ == "__main__":
    sys.exit(main())
