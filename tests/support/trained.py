"""A lamp of the examples, built, trained and exported."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from purelight_mitsuba import platform

if TYPE_CHECKING:  # Mitsuba's variant must be set before it is imported.
    from tests.support.fidelity import Subject


def prepare(lamp: str, output: Path, preset: str, route: str, threads: int) -> Subject:
    """Build, train and export a lamp, or take what an earlier call left."""
    import purelight_train.cli

    run = output / f"{lamp}-{preset}-{route}"
    bundle = run.with_name(run.name + ".plux")
    scene = import_module(f"purelight_examples.luminaires.{lamp}").write(output / "lamps")
    words = [str(scene), "--output", str(run), "--preset", preset, "--route", route, "--resume"]
    words += ["--threads", str(threads)]
    if not bundle.is_file() and purelight_train.cli.main(words) != 0:
        sys.exit(2)
    platform.use()
    import purelight_export.cli
    import purelight_mitsuba
    from tests.support.fidelity import Subject

    purelight_mitsuba.register()
    if not bundle.is_file() and purelight_export.cli.main([str(run), "--output", str(bundle)]):
        sys.exit(2)
    return Subject(scene, run, bundle)
