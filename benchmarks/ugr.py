"""UGR tables against published ones: differences by luminaire and source.

python -m benchmarks.ugr FOLDER

FOLDER is the folder `data` of a checkout of github.com/123VincentB/eulumdat-ugr (MIT), which holds
eleven luminaires (`input/sample_*.ldt`) with the tables that Relux and DIALux print for them, and
the worked example of CIE 190:2010 (sample 11, spacing 1 H).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import command
from purelight_format.photometry.files import read_photometry
from purelight_format.photometry.ugr import SPACING, UgrTable

SOURCES = {"Relux": SPACING, "Dialux": SPACING, "cie190": 1.0}


def table(path: Path) -> NDArray[np.float64]:
    """A published table, NaN where it says less than 10: [19, 10]."""
    rows = [line.split(",") for line in path.read_text().split()]
    return np.array([[np.nan if "<" in cell else float(cell) for cell in row] for row in rows])


def main() -> int:
    """Prints mean and extreme differences."""
    parser = command.Parser(prog="python -m benchmarks.ugr", description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    print(f"{'luminaire':<12}{'source':<10}{'mean':>8}{'least':>8}{'most':>8}")
    for path in sorted((folder / "input").glob("sample_*.ldt")):
        lamp, number = read_photometry(path), path.stem.split("_")[1]
        for source, spacing in SOURCES.items():
            known = folder / "reference" / f"ugr_table_{number}_{source}.csv"
            if not known.is_file():
                continue
            off = UgrTable.of(lamp, spacing).values - table(known)
            if np.isfinite(off).any():
                low, mean, high = np.nanmin(off), np.nanmean(off), np.nanmax(off)
                print(f"{path.stem:<12}{source:<10}{mean:>+8.2f}{low:>+8.2f}{high:>+8.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.ugr", main))
