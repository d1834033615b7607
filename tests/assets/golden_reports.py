"""The report of every bad asset, kept word for word: python -m tests.assets.golden_reports."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from purelight_format.validation.report import Report
from purelight_format.validation.validate import validate
from tests.assets import bad, hostile
from tests.assets.bad import Asset
from tests.support import lamp

PATH = Path(__file__).with_name("golden_reports.json")
REMEDY = "run: python -m tests.assets.golden_reports"
assert hostile.ATTACKS  # Its assets are registered with the others.

MAKERS: dict[str, tuple[Asset, bool]] = {
    f"{code}-{k}": (maker, beside)
    for beside, registry in enumerate((bad.ASSETS, bad.BESIDE))
    for code, makers in registry.items()
    for k, maker in enumerate(makers)
}
NAMES = list(MAKERS)
KEPT = 5  # Issues of a long report.


def report(name: str, folder: Path) -> Report:
    """Validates an asset as a file."""
    return validate(write(name, folder))


def report_of(layer: bytes | None, bundle: bytes | None, folder: Path) -> Report:
    """Validates a bundle, by default the good lamp, with a layer beside it."""
    return validate(_write(layer, bundle, folder))


def write(name: str, folder: Path) -> Path:
    """Writes an asset."""
    maker, beside = MAKERS[name]
    return _write(maker(), None, folder) if beside else _write(None, maker(), folder)


def _write(layer: bytes | None, bundle: bytes | None, folder: Path) -> Path:
    path = folder / "lamp.plux"
    data = lamp.seal_as_written() if bundle is None else bundle
    with open(path, "wb") as file:  # The gigabyte of zeros is a hole.
        file.write(data.rstrip(b"\0"))
        file.truncate(len(data))
    if layer is not None:
        path.with_suffix(".usda").write_bytes(layer)
    return path


def lines(report: Report) -> list[str]:
    """The issues of a report, one line each, the first few."""
    found = [
        f"{i.code.severity.value} {i.code.name} {i.location}: {i.message}" for i in report.issues
    ]
    more = f" of {len(found)}{' and more' if report.truncated else ''}"
    return [*found[:KEPT], f"{found[0].split(':')[0]}{more}"] if len(found) > KEPT else found


def main() -> None:
    """Writes the golden reports anew."""
    reports = {}
    for name in NAMES:
        with tempfile.TemporaryDirectory() as folder:
            reports[name] = lines(report(name, Path(folder)))
    PATH.write_text(json.dumps(reports, indent=1, ensure_ascii=False) + "\n")
    codes = {name.split("-")[0] for name in NAMES}
    print(f"{len(reports)} golden reports of {len(codes)} codes")


if __name__ == "__main__":
    main()
