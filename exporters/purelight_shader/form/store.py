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
        written: constants of at most so many elements are written into the code.
    """

    def __init__(self, written: int) -> None:
        self.written = written
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
        known = self._known.get(key)
        if known is not None and not (buffered and known.place is None):
            return known
        inside = kind is Kind.LONG or (flat.size <= self.written and not buffered)
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
