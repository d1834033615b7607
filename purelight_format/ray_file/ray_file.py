"""A ray file as it is stored."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

PLACE = ("x", "y", "z")
TOWARD = ("kx", "ky", "kz")
WATTS, WAVELENGTH, LUMENS = "watts", "wavelength", "lumens"
CHUNK = 1 << 20
SLACK = 0.01  # Between what a header says and what the rays sum up to.
Table = NDArray[np.float32]


@dataclass(frozen=True)
class RayFile:
    """What a ray file holds.

    Arguments:
        name: of the light source.
        columns: what each number of a row is: `PLACE`, `TOWARD`, then some of `watts`,
            `wavelength`, `lumens`, `X`, `Z`, `spectrum`, and others.
        rows: [N, columns] float32, as they are in the file and perhaps still there.
        metres: in a unit of position.
        nanometres: in a unit of wavelength.
        stated: flux that the header tells, by `watts` and `lumens`; missing ones are left out.
        wavelength: of all rays in nm, if the header tells it.
        spectra: wavelengths in nm and weights, [W] each: one of all rays, or one for each number
            from 1 in the column `spectrum`.
        texts: what the header says else, by its own names.
        notes: about repairs and assumptions.
    """

    name: str
    columns: tuple[str, ...]
    rows: Table
    metres: float = 1e-3
    nanometres: float = 1.0
    stated: Mapping[str, float] = field(default_factory=dict)
    wavelength: float | None = None
    spectra: tuple[tuple[Table, Table], ...] = ()
    texts: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.rows)

    def column(self, name: str, part: slice = slice(None)) -> NDArray[np.float64]:
        """A column, or some rows of it, in float64: [N]."""
        return self.rows[part, self.columns.index(name)].astype(np.float64)

    def chunks(self) -> Iterator[slice]:
        """All rows in parts that fit into memory."""
        for first in range(0, len(self), CHUNK):
            yield slice(first, min(first + CHUNK, len(self)))

    def total(self, name: str) -> float:
        """Sum of a column of flux over all rays; what is not finite or below zero is left out."""
        found = 0.0
        for part in self.chunks():
            value = self.column(name, part)
            found += float(value[np.isfinite(value) & (value > 0)].sum())
        return found

    def totals(self) -> dict[str, float]:
        """Sums of the columns `watts` and `lumens`, those that there are."""
        return {name: self.total(name) for name in (WATTS, LUMENS) if name in self.columns}

    def flux_notes(self) -> list[str]:
        """Where the rays do not sum up to what the header says."""
        found = []
        for name, total in self.totals().items():
            stated = self.stated.get(name)
            if stated and abs(total / stated - 1) > SLACK:
                found.append(f"its header says {stated:.5g} {name}, its rays sum up to "
                             f"{total:.5g}; the rays count")  # fmt: skip
        return found
