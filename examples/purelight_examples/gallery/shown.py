"""What the gallery shows of a lamp or a room that is made: graded pictures and figures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_examples.exr import read_exr
from purelight_examples.luminaires.catalog import CATALOG, Entry
from purelight_format.bundle import Bundle
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_format.members.manifest import Manifest
from purelight_train.report.grading import Grade, exposure, white_balance
from purelight_train.runs.progress import duration

Image = NDArray[np.float64]
BALANCE = 0.6  # how far a lamp's colour is moved towards white
DAY = Grade((1.0, 1.0, 1.0), -0.4)


@dataclass(frozen=True)
class LampShown:
    """A lamp of the gallery in `folder`."""

    folder: Path
    name: str

    @property
    def entry(self) -> Entry:
        return CATALOG[self.name]

    @cached_property
    def manifest(self) -> Manifest:
        return Bundle.open(self.folder / self.name / "lamp.plux").manifest

    def picture(self, kind: str) -> tuple[Image, Grade]:
        """`portrait`, `seen` or `wall`, and how it is graded."""
        image = read_exr(self.folder / self.name / f"{kind}.exr")
        if kind == "portrait":
            return image, DAY
        gains = white_balance(self.manifest.flux, BALANCE)
        balanced = image * np.asarray(gains)
        lit = balanced[balanced.sum(-1) > 0][None]
        percentile = 80 if kind == "seen" else 85
        return image, Grade(gains, exposure(lit, percentile) if lit.size else 0.0)

    def figures(self) -> dict[str, str]:
        """What is written below the lamp."""
        trained = self._record("train")["figures"]
        size = self._record("export")["figures"]["bytes"]
        return {
            "light": f"{self.lumens:,.0f} lm",
            "triangles": f"{self._record('lamp')['figures']['triangles']:,}",
            "training": duration(trained["seconds"]),
            "file": f"{size / 1e6:.1f} MB",
        }

    def line(self) -> str:
        """The figures in one line."""
        return ", ".join(f"{name} {value}" for name, value in self.figures().items())

    @property
    def lumens(self) -> float:
        """Luminous flux."""
        return LUMENS_PER_WATT * float(LUMINANCE @ np.asarray(self.manifest.flux))

    def _record(self, stage: str) -> dict[str, Any]:
        path = self.folder / self.name / ".stages" / f"{stage}.json"
        record: dict[str, Any] = json.loads(path.read_text())
        return record


@dataclass(frozen=True)
class RoomShown:
    """A room of the gallery in `folder`."""

    folder: Path
    name: str

    def picture(self) -> tuple[Image, Grade]:
        """The room, and how it is graded."""
        image = read_exr(self.folder / "rooms" / self.name / "room.exr")
        gains = white_balance(np.median(image, (0, 1)).tolist(), BALANCE)
        return image, Grade(gains, exposure(image * np.asarray(gains), 85))
