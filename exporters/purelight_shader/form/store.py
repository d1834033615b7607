"""The constants of a lamp's networks, packed into one buffer of floats and one of integers."""

from __future__ import annotations

import numpy as np

from purelight_shader.form.elements import Constant, Kind

FOUR = 4
EXACT = 1 << 24  # Integers up to this size are floats as well.
DTYPES = {Kind.FLOAT: np.float32, Kind.INT: np.int32, Kind.LONG: np.int64}


class Store:
    """Gives constants their places; equal ones share one.

    Arguments:
        written: constants of at most so many elements are written into the code,
        room: as long as all of them together have at most so many.
        fours: whether what could be read in fours must lie in a buffer.
    """

    def __init__(self, written: int = 16, *, room: int = 1 << 20, fours: bool = True) -> None:
        self.written, self.room, self.fours = written, room, fours
        self._parts: dict[Kind, list[np.ndarray]] = {Kind.FLOAT: [], Kind.INT: []}
        self._sizes = {Kind.FLOAT: 0, Kind.INT: 0}
        self._known: dict[tuple[Kind, bytes], Constant] = {}

    def add(self, data: np.ndarray, kind: Kind, *, buffered: bool = False) -> Constant:
        """A constant of these elements in this order.

        Arguments:
            buffered: whether it must lie in a buffer, as what is read in fours.
        """
        flat = np.ascontiguousarray(data, DTYPES[kind]).ravel()
        key = kind, flat.tobytes()
        known, buffered = self._known.get(key), buffered and self.fours
        if known is not None and not (buffered and known.place is None):
            return known
        fits = flat.size <= min(self.written, self.room) and not buffered
        inside = kind is Kind.LONG or fits
        self.room -= flat.size if inside else 0
        exact = kind is Kind.FLOAT or bool((np.abs(flat.astype(np.int64)) <= EXACT).all())
        buffer = Kind.FLOAT if exact else Kind.INT
        place = None if inside else self._reserve(flat, buffer)
        made = Constant(kind, flat, place, buffer, len(self._known))
        self._known[key] = made
        return made

    def _reserve(self, flat: np.ndarray, kind: Kind) -> int:
        place = self._sizes[kind]
        padded = -(-flat.size // FOUR) * FOUR
        self._parts[kind].append(flat)
        self._sizes[kind] += padded
        return place

    def size(self, kind: Kind) -> int:
        """Elements of a buffer, a multiple of four."""
        return self._sizes[kind]

    def buffer(self, kind: Kind) -> np.ndarray:
        """A buffer [fours, 4]."""
        result = np.zeros(self._sizes[kind], DTYPES[kind])
        place = 0
        for part in self._parts[kind]:
            result[place : place + part.size] = part
            place += -(-part.size // FOUR) * FOUR
        return result.reshape(-1, FOUR)
