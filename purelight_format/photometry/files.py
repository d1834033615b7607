"""Photometric files on disk, whatever their format."""

from __future__ import annotations

import re
from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_format.files import read_file
from purelight_format.limits import LIMITS
from purelight_format.photometry.eulumdat_reader import eulumdat_photometry
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.reader import ies_photometry
from purelight_format.photometry.text import decoded

SUFFIXES = (".ies", ".ldt")
IES = re.compile(r"^\s*(IESNA|IES:|TILT\s*=)", re.IGNORECASE | re.MULTILINE)


def is_photometric(path: Path) -> bool:
    """Whether a path is named like a photometric file."""
    return path.suffix.lower() in SUFFIXES


def read_photometry(path: Path) -> LampPhotometry:
    """Reads an IES LM-63 or EULUMDAT file; its content tells which, not its name.

    Raises:
        PureLightError: If it cannot be read, or is neither.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise PureLightError(f"{path}: give an IES (.ies) or EULUMDAT (.ldt) file")
    data = read_file(path, LIMITS.picture_bytes)
    read = ies_photometry if IES.search(decoded(data)) else eulumdat_photometry
    return read(data, path.name)
