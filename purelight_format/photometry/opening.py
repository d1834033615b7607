"""The luminous part of a luminaire as photometric files give it: a box, a drum or a ball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BOX, DRUM, BALL = "box", "drum", "ball"


@dataclass(frozen=True)
class Opening:
    """A luminous body in metres.

    Arguments:
        width: along X, the plane C0 - C180.
        length: along Y, the plane C90 - C270.
        heights: of the luminous sides that face C0, C90, C180 and C270.
        shape: what is seen: a box, a drum (elliptical, its axis vertical), or a ball (an ellipsoid
            of the first height).
    """

    width: float = 0.0
    length: float = 0.0
    heights: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    shape: str = BOX

    @property
    def is_point(self) -> bool:
        return not (self.width or self.length or any(self.heights))

    def projected_area(self, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
        """Area seen from directions in degrees: [N], [N] -> [N] in m²."""
        polar, azimuth = np.radians(vertical), np.radians(horizontal)
        sine, cosine = np.sin(polar), np.abs(np.cos(polar))
        x, y = np.cos(azimuth), np.sin(azimuth)
        if self.shape == BALL:
            a, b, c = self.width / 2, self.length / 2, self.heights[0] / 2
            parts = (b * c * x * sine, a * c * y * sine, a * b * cosine)
            return np.pi * np.sqrt(sum(part**2 for part in parts))
        c0, c90, c180, c270 = self.heights
        if self.shape == DRUM:
            seen = np.hypot(self.width * y, self.length * x) * (c0 + c90 + c180 + c270) / 4
            return np.pi / 4 * self.width * self.length * cosine + seen * sine
        across = self.length * np.where(x > 0, c0, c180) * np.abs(x)
        along = self.width * np.where(y > 0, c90, c270) * np.abs(y)
        return self.width * self.length * cosine + (across + along) * sine

    @staticmethod
    def of_ies(size: Sequence[float], unit: float, *, old: bool) -> Opening:
        """The opening of an LM-63 file, whose signs tell the shape (LM-63-2019, table 1).

        Negative dimensions are diameters. The length lies in the plane of horizontal angle 0.
        Editions before 2002 give one diameter of what is round, as the width.

        Arguments:
            size: width, length and height.
            unit: metres in a unit of the file.
            old: Whether the edition is one of those.
        """
        width, length, height = size
        if width < 0 and length == 0 and (old or height >= 0):
            length = width
        along, across, up = (float(abs(size) * unit) for size in (length, width, height))
        flat_round = width < 0 and length < 0
        shape = BALL if flat_round and height < 0 else DRUM if flat_round else BOX
        return Opening(along, across, (up,) * 4, shape)

    def to_eulumdat(self) -> tuple[float, float, tuple[float, float, float, float]]:
        """Length, width (0 for what is round) and heights in metres.

        A ball becomes the drum that shows as much from below and from the sides.
        """
        c0, c90, c180, c270 = self.heights
        if self.shape == BALL:
            c0 = c90 = c180 = c270 = np.pi / 4 * self.heights[0]
        is_round = self.shape in (BALL, DRUM) and abs(self.width - self.length) <= 0.1 * self.length
        width = 0.0 if is_round else self.width
        return self.length, width, (c0, c90, c180, c270)


POINT = Opening()
