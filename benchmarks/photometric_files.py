"""Photometric files from anywhere: which are read, and whether others find the same flux.

python -m benchmarks.photometric_files FOLDER [FOLDER ...]

Reads every .ies and .ldt below the folders once (copies are left out), and asks photompy (IES) and
eulumdat-py (EULUMDAT) for the flux of the same file where they can read it. Then writes each table
in both formats anew, and asks both for the flux of what was written.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from pathlib import Path

import numpy as np
from photompy import IESFile
from pyldt import LdtReader

from purelight_format import command
from purelight_format.errors import PureLightError
from purelight_format.photometry.eulumdat_writer import eulumdat_text
from purelight_format.photometry.files import is_photometric, read_photometry
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.table import node_solid_angle
from purelight_format.photometry.writer import ies_text

Off = list[tuple[float, str]]


def other_flux(path: Path) -> float | None:
    """What another library finds, if it can read the file; evenly spaced planes C alone."""
    try:
        if path.suffix.lower() == ".ies":
            found = IESFile.read(path.read_bytes()).photometry
            return float(found.total_optical_power()) if found.photometric_type == 1 else None
        file = LdtReader.read(path)
        planes, angles = (np.array(a) for a in (file.header.c_angles, file.header.g_angles))
        if len(planes) > 2 and np.ptp(np.diff(planes)) > 1e-3:
            return None
        intensity = np.array(file.intensities).mean(0) @ node_solid_angle(angles)
        return float(intensity * file.header.lamp_flux[0] / 1000)
    except Exception:  # Whatever it is, it is theirs.
        return None


def written(lamp: LampPhotometry, folder: Path) -> dict[str, float]:
    """How far others are from the flux, each in the format that they read, when we wrote it."""
    texts = {
        "ies": ies_text(lamp.table, {"LUMINAIRE": lamp.name}, radius=0.0, watts=lamp.watts),
        "ldt": eulumdat_text(lamp, maker="PureLight", issued="2026-01-01", size=(0.1, 0.1, 0.1)),
    }
    result = {}
    for kind, text in texts.items():
        path = folder / f"lamp.{kind}"
        path.write_bytes(text)
        other = other_flux(path)
        if other and lamp.table.flux:
            result[kind] = abs(lamp.table.flux / other - 1)
    return result


def tell(off: Off, whose: str) -> None:
    """Prints how many are within half a percent, and which are not."""
    for part, name in sorted(off, reverse=True):
        if part >= 0.005:
            print(f"  {100 * part:.3f} % from another library: {name}")
    within, parts = sum(part < 0.005 for part, _ in off), [part for part, _ in off] or [0.0]
    print(
        f"{whose}: {within} of {len(off)} within 0.5 %, median {100 * np.median(parts):.4f} %, "
        f"largest {100 * max(parts):.3f} %"
    )


def main() -> int:
    """Prints what could not be read and how far the others are, and the counts."""
    parser = command.Parser(
        prog="python -m benchmarks.photometric_files", description=__doc__.split("\n")[0]
    )
    parser.add_argument("folders", type=Path, nargs="+")
    seen: set[bytes] = set()
    read, refused = 0, 0
    off: dict[str, Off] = {"as they came": [], "written as ies": [], "written as ldt": []}
    for folder in parser.parse_args().folders:
        for path in sorted(p for p in folder.rglob("*") if p.is_file() and is_photometric(p)):
            digest = hashlib.sha256(path.read_bytes()).digest()
            if digest in seen:
                continue
            seen.add(digest)
            try:
                lamp, other = read_photometry(path), other_flux(path)
            except PureLightError as error:
                refused += 1
                print(error)
                continue
            read += 1
            if other and lamp.table.flux:
                off["as they came"].append((abs(lamp.table.flux / other - 1), path.name))
            with tempfile.TemporaryDirectory() as work:
                for kind, part in written(lamp, Path(work)).items():
                    off[f"written as {kind}"].append((part, path.name))
    print(f"{read} files read, {refused} refused")
    for whose, parts in off.items():
        tell(parts, whose)
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.photometric_files", main))
