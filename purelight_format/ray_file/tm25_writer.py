"""Rays as IES TM-25-13; see `tm25` for the layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import atomic
from purelight_format.ray_file.ray_file import PLACE, TOWARD, RayFile
from purelight_format.ray_file.tm25 import (
    FIRST_VERSION,
    HEADER,
    INDEXED,
    MAGIC,
    PADDING,
    PER_RAY,
    SINGLE,
    TABLE,
    TEXTS,
    UNKNOWN,
)

ORDER = (*PLACE, *TOWARD, "watts", "wavelength", "lumens", "X", "Z", "spectrum")
LONGEST = 999  # Characters of a text.


def write_tm25(path: Path, file: RayFile) -> None:
    """Writes a file crash-safely, with the sums of its rays in the header.

    Positions and wavelengths are brought to millimetres and nanometres. Columns that are none of
    `ORDER` are left out.
    """
    columns = [file.columns.index(name) for name in ORDER if name in file.columns]
    scale = np.ones(len(columns))
    scale[:3] = file.metres * 1e3
    if "wavelength" in file.columns:
        scale[columns.index(file.columns.index("wavelength"))] = file.nanometres
    with atomic.replace_file(path) as out:
        out.write(_header(file).tobytes() + _spectra(file))
        for part in file.chunks():
            rows = file.rows[part][:, columns]
            out.write((rows if (scale == 1).all() else rows * scale).astype("<f4").tobytes())


def _header(file: RayFile) -> NDArray[np.void]:
    head = np.zeros((), HEADER)
    head["magic"], head["version"], head["rays"] = MAGIC, FIRST_VERSION, len(file)
    totals = dict(file.stated) | file.totals()
    for name in ("lumens", "watts"):
        head[name] = totals.get(name, UNKNOWN)
    head["method"] = int(file.texts.get("method", "0") == "1")
    head["date"] = file.texts.get("date", "").encode("ascii", "replace")
    head["spectral"] = _spectral(file)
    head["wavelength"] = file.wavelength or UNKNOWN
    head["shortest"], head["longest"] = _range(file)
    head["spectra"] = len(file.spectra)
    flags = ("x", "kx", "watts", "wavelength", "lumens", "S", "X", "spectrum")
    head["flags"] = [name in file.columns for name in flags]
    for row, key in zip(head["texts"], TEXTS, strict=True):
        text = (file.name if key == "name" else file.texts.get(key) or "unknown")[:LONGEST]
        row[: len(text)] = [ord(letter) for letter in text]
    return head


def _spectra(file: RayFile) -> bytes:
    """The spectra, padded."""
    blocks = b"".join(
        np.array(len(values), "<i4").tobytes()
        + np.stack([values, weights], 1).astype("<f4").tobytes()
        for values, weights in file.spectra
    )
    return blocks + bytes(-len(blocks) % PADDING)


def _spectral(file: RayFile) -> int:
    """The kind of spectral data, 0 for none."""
    if "spectrum" in file.columns:
        return INDEXED
    if file.spectra:
        return TABLE
    if "wavelength" in file.columns:
        return PER_RAY
    return SINGLE if file.wavelength else 0


def _range(file: RayFile) -> tuple[float, float]:
    """Shortest and longest wavelength, where they are known."""
    if file.spectra:
        every = np.concatenate([values for values, _ in file.spectra]).astype(np.float64)
    elif "wavelength" in file.columns:
        every = file.column("wavelength") * file.nanometres
    else:
        return UNKNOWN, UNKNOWN
    return float(np.nanmin(every)), float(np.nanmax(every))
