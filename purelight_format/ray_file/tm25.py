"""IES TM-25 ray files (.tm25ray), as the readers and writers in public describe them.

Little endian. 256 bytes of header, 8 flags of what a ray has, nine texts of 1000 UTF-32 characters,
spectra (a count, then pairs) padded to 32 bytes, names of additional columns in 512 bytes each,
additional text, then rows of float32. Lengths are in millimetres, wavelengths in nm. What is not
known is a signalling NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.ray_file.mapped import Mapped
from purelight_format.ray_file.ray_file import PLACE, TOWARD, RayFile

MAGIC = b"TM25"
TEXTS = (
    "name", "manufacturer", "model", "made_by", "equipment", "camera", "operation", "information",
    "reference",
)  # fmt: skip
HEADER = np.dtype([
    ("magic", "S4"), ("version", "<i4"), ("method", "<i4"), ("lumens", "<f4"), ("watts", "<f4"),
    ("rays", "<u8"), ("date", "S28"), ("start", "<i4"), ("spectral", "<i4"), ("wavelength", "<f4"),
    ("shortest", "<f4"), ("longest", "<f4"), ("spectra", "<i4"), ("columns", "<i4"),
    ("text", "<i4"), ("reserved", "V168"), ("flags", "<i4", 8), ("texts", "<u4", (9, 1000)),
])  # fmt: skip
FIRST_VERSION = 2013
SINGLE, PER_RAY, TABLE, INDEXED = 1, 2, 3, 4  # Kinds of spectral data.
STOKES = ("S1", "S2", "S3", "ellipse_x", "ellipse_y", "ellipse_z")
MOST_COLUMNS, MOST_SPECTRA, LABEL = 256, 1 << 16, 512
UNKNOWN = np.frombuffer(b"\x00\x00\xa0\x7f", "<f4")[0]
PADDING = 32


def read_tm25(source: Mapped) -> RayFile:
    """Maps a TM-25 file; its counts are compared with its size before anything is made of them.

    Raises:
        PureLightError: If it is no TM-25 file, or not what it says.
    """
    return _Reader(source).file()


@dataclass
class _Reader:
    """Goes through a file from its beginning."""

    source: Mapped
    offset: int = HEADER.itemsize

    def __post_init__(self) -> None:
        head = self.source.numbers("V1", HEADER.itemsize, 0).tobytes()
        self.head = np.frombuffer(head, HEADER)[0]

    def file(self) -> RayFile:
        """The whole file."""
        notes = self._version_notes()
        self._require(self.head["rays"] > 0, "holds no rays")
        spectra = self._spectra()
        labels = self._labels()
        texts = {key: _text(row) for key, row in zip(TEXTS, self.head["texts"], strict=True)}
        texts["date"] = bytes(self.head["date"]).split(b"\0")[0].decode("ascii", "replace")
        texts["method"] = str(int(self.head["method"]))
        texts["additional"] = self._additional_text()
        columns = self._columns(labels)
        count = int(self.head["rays"])
        rows = self.source.numbers("<f4", count * len(columns), self.offset)
        left = len(self.source) - self.offset - rows.nbytes
        if left:
            notes.append(f"{left} bytes behind its rays are left out")
        single = float(self.head["wavelength"]) if self.head["spectral"] == SINGLE else 0.0
        return RayFile(
            texts["name"] or Path(self.source.name).stem, columns,
            rows.reshape(count, len(columns)), stated=self._stated(),
            wavelength=single if single > 0 else None, spectra=spectra, texts=texts,
            notes=tuple(notes),
        )  # fmt: skip

    def _require(self, sound: bool, problem: str) -> None:
        if not sound:
            raise PureLightError(f"{self.source.name}: {problem}")

    def _version_notes(self) -> list[str]:
        version = int(self.head["version"])
        self._require(bytes(self.head["magic"]) == MAGIC, "not a TM-25 ray file")
        self._require(FIRST_VERSION <= version < 2100, f"TM-25 of version {version} is unknown")
        return [] if version == FIRST_VERSION else [f"version {version}, read as {FIRST_VERSION}"]

    def _stated(self) -> dict[str, float]:
        values = {name: float(self.head[name]) for name in ("lumens", "watts")}
        return {name: value for name, value in values.items() if 0 < value < np.inf}

    def _spectra(self) -> tuple[tuple[NDArray[np.float32], NDArray[np.float32]], ...]:
        count = int(self.head["spectra"])
        self._require(0 <= count <= MOST_SPECTRA, f"{count} spectra")
        begin, found = self.offset, []
        for _ in range(count):
            pairs = int(self.source.numbers("<i4", 1, self.offset)[0])
            self._require(pairs > 0, f"a spectrum of {pairs} values")
            table = self.source.numbers("<f4", 2 * pairs, self.offset + 4).reshape(-1, 2)
            self._require(_is_spectrum(table), "a spectrum that is none")
            found.append((table[:, 0], table[:, 1]))
            self.offset += 4 + table.nbytes
        self.offset += -(self.offset - begin) % PADDING
        needed = self.head["spectral"] in (TABLE, INDEXED)
        self._require(bool(found) or not needed, "its spectra are missing")
        return tuple(found)

    def _labels(self) -> list[str]:
        count = int(self.head["columns"])
        self._require(0 <= count <= MOST_COLUMNS, f"{count} additional columns")
        raw = self.source.numbers("<u4", count * LABEL // 4, self.offset)
        self.offset += raw.nbytes
        names = [_text(row) for row in raw.reshape(count, LABEL // 4)]
        return [f"{name or 'column'} ({k})" for k, name in enumerate(names, 1)]

    def _additional_text(self) -> str:
        size = int(self.head["text"])
        self._require(size >= 0 and size % 4 == 0, f"additional text of {size} bytes")
        raw = self.source.numbers("<u4", size // 4, self.offset)
        self.offset += size
        return _text(raw[: 1 << 16])

    def _columns(self, labels: list[str]) -> tuple[str, ...]:
        """What each number of a row is.

        Files disagree whether polarised light has three numbers more or six: the size tells.
        """
        flags = self.head["flags"]
        self._require(set(flags.tolist()) <= {0, 1}, "flags that are neither 0 nor 1")
        self._require(bool(flags[0] and flags[1]), "its rays have no position or no direction")
        _, _, watts, wavelength, lumens, stokes, tristimulus, index = flags.tolist()
        self._require(bool(watts or lumens), "its rays have no flux")
        self._require(not tristimulus or bool(lumens), "tristimulus values without luminous flux")
        layouts = [
            (
                *PLACE, *TOWARD, *["watts"] * watts, *["wavelength"] * wavelength,
                *["lumens"] * lumens, *STOKES[: more * stokes], *["X", "Z"][: 2 * tristimulus],
                *["spectrum"] * index, *labels,
            )
            for more in (6, 3)
        ]  # fmt: skip
        left, count = len(self.source) - self.offset, int(self.head["rays"])
        even = [layout for layout in layouts if 4 * len(layout) * count == left]
        return (even or layouts[1:])[0]


def _is_spectrum(table: NDArray[np.float32]) -> bool:
    return bool(np.isfinite(table).all() and (table[:, 0] > 0).all() and (table[:, 1] >= 0).all())


def _text(codes: NDArray[np.uint32]) -> str:
    """UTF-32 up to its first zero; what is no character becomes a question mark."""
    end = np.flatnonzero(codes == 0)
    codes = codes[: end[0]] if len(end) else codes
    return "".join(chr(c) if c < 0xD800 or 0xE000 <= c < 0x110000 else "?" for c in codes.tolist())
