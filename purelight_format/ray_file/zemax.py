"""Source files of Zemax OpticStudio (.dat, .sdf), binary and text, as its manual describes them.

Binary, little endian: 208 bytes of header, of which the number of rays, the unit of length, the
kind of rays and of flux count, then rows of float32: x y z l m n flux, and a wavelength in
micrometres where the kind is spectral. Text: number of rays and unit of length in the first line,
then a line of the same numbers for each ray.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_format.ray_file.mapped import Mapped
from purelight_format.ray_file.ray_file import LUMENS, PLACE, TOWARD, WATTS, WAVELENGTH, RayFile

HEADER = np.dtype([
    ("version", "<i4"), ("rays", "<u4"), ("description", "S100"), ("source_flux", "<f4"),
    ("flux", "<f4"), ("wavelength", "<f4"), ("angles", "<f4", 4), ("unit", "<u4"),
    ("place", "<f4", 3), ("turn", "<f4", 3), ("scale", "<f4", 3), ("unused", "<f4", 4),
    ("kind", "<i4"), ("flux_kind", "<i4"), ("reserved", "<i4", 2),
])  # fmt: skip
VERSION = 1010
FLUX_ONLY, SPECTRAL = 0, 2
METRES = (1.0, 0.0254, 0.01, 0.3048, 0.001)  # By the header's unit.
MILLIMETRES = 4
MICROMETRE = 1000.0  # In nanometres.
TEXT_BYTES = 1 << 30
MOST_RAYS = 4_000_000_000


def is_zemax(source: Mapped) -> bool:
    """Whether a file is a binary source file."""
    if len(source) < HEADER.itemsize:
        return False
    return int(source.numbers("<i4", 1, 0)[0]) == VERSION


def read_zemax(source: Mapped) -> RayFile:
    """Maps a binary source file.

    Raises:
        PureLightError: Its header is not what it should be, or it is cut off.
    """
    head = np.frombuffer(source.numbers("V1", HEADER.itemsize, 0).tobytes(), HEADER)[0]
    kind, flux_kind, unit = int(head["kind"]), int(head["flux_kind"]), int(head["unit"])
    if kind not in (FLUX_ONLY, SPECTRAL) or flux_kind not in (0, 1) or unit >= len(METRES):
        raise PureLightError(
            f"{source.name}: a Zemax file of unknown kind ({kind}, {flux_kind}, {unit})"
        )
    flux = LUMENS if kind == FLUX_ONLY and flux_kind == 1 else WATTS
    columns = (*PLACE, *TOWARD, flux, *([WAVELENGTH] if kind == SPECTRAL else []))
    count = int(head["rays"])
    if not 0 < count <= MOST_RAYS:
        raise PureLightError(f"{source.name}: announces {count} rays")
    rows = source.numbers("<f4", count * len(columns), HEADER.itemsize)
    left = len(source) - HEADER.itemsize - rows.nbytes
    single = float(head["wavelength"]) * MICROMETRE if kind == FLUX_ONLY else 0.0
    stated = float(head["flux"])
    return RayFile(
        bytes(head["description"]).split(b"\0")[0].decode("latin-1").strip()
        or Path(source.name).stem,
        columns, rows.reshape(count, -1), METRES[unit], MICROMETRE,
        stated={flux: stated} if 0 < stated < np.inf else {},
        wavelength=single if 0 < single < 1e4 else None,
        notes=(f"{left} bytes behind its rays are left out",) if left else (),
    )  # fmt: skip


def read_zemax_text(source: Mapped) -> RayFile:
    """Reads a source file in text.

    Raises:
        PureLightError: It is none.
    """
    wrong = PureLightError(f"{source.name}: not a ray file (TM-25, or a Zemax source file)")
    if len(source) > TEXT_BYTES:
        raise wrong
    text = bytes(source.data[:]).decode("latin-1").lstrip("\ufeff\xef\xbb\xbf").replace(",", " ")
    first, _, rest = text.partition("\n")
    head = _floats(first)
    if head is None or len(head) < 2 or not head[0] >= 1 or head[1] not in range(len(METRES)):
        raise wrong
    try:
        rows = np.loadtxt(io.StringIO(rest), np.float32, ndmin=2, comments=("#", "!", "%"))
    except ValueError as error:
        raise wrong from error
    if rows.shape[1] not in (7, 8) or not len(rows):
        raise wrong
    notes = ["in text, so that its flux is taken as watts"]
    if len(rows) != head[0]:
        notes.append(f"announces {head[0]:g} rays and has {len(rows)}")
    columns = (*PLACE, *TOWARD, WATTS, WAVELENGTH)[: rows.shape[1]]
    metres = METRES[int(head[1])]
    return RayFile(
        Path(source.name).stem, columns, rows, metres, MICROMETRE, notes=tuple(notes)
    )  # fmt: skip


def write_zemax(path: Path, file: RayFile) -> None:
    """Writes a binary source file crash-safely: luminous flux, or watts with wavelengths.

    What the format has no room for is left out: colour beside lumens, spectra, polarisation.
    """
    spectral = WAVELENGTH in file.columns and LUMENS not in file.columns
    flux = LUMENS if LUMENS in file.columns else WATTS
    names = (*PLACE, *TOWARD, flux, *([WAVELENGTH] if spectral else []))
    columns = [file.columns.index(name) for name in names]
    head = np.zeros((), HEADER)
    head["version"], head["rays"], head["unit"] = VERSION, len(file), MILLIMETRES
    head["description"] = file.name.encode("latin-1", "replace")[:99]
    head["source_flux"] = head["flux"] = file.total(flux)
    head["wavelength"] = (file.wavelength or 0.0) / MICROMETRE
    head["scale"], head["kind"] = 1, SPECTRAL if spectral else FLUX_ONLY
    head["flux_kind"] = int(flux == LUMENS)
    scale = np.array(
        [file.metres * 1e3] * 3 + [1.0] * 4 + [file.nanometres / MICROMETRE] * spectral
    )
    with atomic.replace_file(path) as out:
        out.write(head.tobytes())
        for part in file.chunks():
            out.write(_scaled(file.rows[part][:, columns], scale).astype("<f4").tobytes())


def _scaled(rows: NDArray[np.float32], scale: NDArray[np.float64]) -> NDArray[np.floating]:
    return rows if (scale == 1).all() else rows * scale


def _floats(line: str) -> list[float] | None:
    try:
        return [float(word) for word in line.split()]
    except ValueError:
        return None
