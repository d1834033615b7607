"""Photometric files from anywhere: which are read, and whether others find the same flux.

python -m benchmarks.photometric_files FOLDER [FOLDER ...]

Reads every .ies and .ldt below the folders once (copies are left out), and asks photompy (IES) and
eulumdat-py (EULUMDAT) for the flux of the same file where they can read it.
"""

from __future__ import annotations

import argparse
import hashlib
from pathlib import Path

import numpy as np
from photompy import IESFile
from pyldt import LdtReader

from purelight_format.errors import PureLightError
from purelight_format.photometry.files import is_photometric, read_photometry
from purelight_format.photometry.table import node_solid_angle


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


def main() -> int:
    """Prints what could not be read and how far the others are, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folders", type=Path, nargs="+")
    seen: set[bytes] = set()
    read, refused, off = 0, 0, []
    for folder in parser.parse_args().folders:
        for path in sorted(p for p in folder.rglob("*") if p.is_file() and is_photometric(p)):
            digest = hashlib.sha256(path.read_bytes()).digest()
            if digest in seen:
                continue
            seen.add(digest)
            try:
                flux, other = read_photometry(path).table.flux, other_flux(path)
            except PureLightError as error:
                refused += 1
                print(error)
                continue
            read += 1
            if other and flux:
                off.append((abs(flux / other - 1), path.name))
    print(f"{read} files read, {refused} refused; others read {len(off)} of them")
    for part, name in sorted(off, reverse=True)[:5]:
        print(f"  {100 * part:.3f} % from another library: {name}")
    within = sum(part < 0.005 for part, _ in off)
    print(
        f"{within} of {len(off)} within 0.5 %, median {100 * np.median([p for p, _ in off]):.4f} %"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
