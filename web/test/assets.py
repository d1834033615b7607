"""Lamps and damaged files for the tests of the page: python -m web.test.assets FOLDER.

`bad/` has the bundles of tests/assets with the reports of `purelight-validate`, `good/` small lamps
with the words of `purelight-inspect`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from purelight_format.bundle import Bundle
from purelight_format.members import container
from purelight_format.summary import summary_text
from tests.assets import golden_reports
from tests.support import lamp

ROOT = Path(__file__).parents[2]


def main(folder: Path) -> None:
    """Writes the files and `expected.json`."""
    for name in ("bad", "good"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    expected = {"bad": write_bad(folder / "bad"), "good": write_good(folder / "good")}
    (folder / "expected.json").write_text(json.dumps(expected))


def write_bad(folder: Path) -> dict[str, list[str]]:
    """Every bad bundle of the repository; their reports by name."""
    kept = json.loads(golden_reports.PATH.read_text())
    made = {name: make for name, (make, beside) in golden_reports.MAKERS.items() if not beside}
    for name, make in made.items():
        data = make()
        with open(folder / f"{name}.plux", "wb") as file:  # The gigabyte of zeros is a hole.
            file.write(data.rstrip(b"\0"))
            file.truncate(len(data))
    return {name: kept[name] for name in made}


def write_good(folder: Path) -> dict[str, str]:
    """Small lamps; what is said of them by name."""
    lamps = {
        "octahedron": container.pack(lamp.good()),
        "smallest": (ROOT / "spec/example.plux").read_bytes(),
    }
    for name, data in lamps.items():
        (folder / f"{name}.plux").write_bytes(data)
    return {name: summary_text(Bundle.open(folder / f"{name}.plux")) for name in lamps}


if __name__ == "__main__":
    main(Path(sys.argv[1]))
