"""Random choices that are the same on any machine and with any NumPy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


class Draw:
    """Choices from a key of whole numbers.

    Only the raw bits of PCG64 and of its seeding are used, which NumPy promises never to change;
    the streams of its distributions may (NEP 19).
    """

    def __init__(self, *key: int) -> None:
        self._bits = np.random.PCG64(np.random.SeedSequence(key))

    def number(self, low: float = 0.0, high: float = 1.0) -> float:
        """Uniform in [low, high)."""
        return low + (high - low) * ((int(self._bits.random_raw()) >> 11) * 2.0**-53)

    def log(self, low: float, high: float) -> float:
        """Uniform in the logarithm, low to high."""
        return math.exp(self.number(math.log(low), math.log(high)))

    def whole(self, low: int, high: int) -> int:
        """A whole number from low to high, both included."""
        return low + int(self.number() * (high - low + 1))

    def chance(self, probability: float) -> bool:
        """True with that probability."""
        return self.number() < probability

    def pick(self, options: Sequence[T], weights: Sequence[float] | None = None) -> T:
        """One of the options, all as likely or in proportion to their weights."""
        if weights is None:
            return options[self.whole(0, len(options) - 1)]
        rest = self.number() * sum(weights)
        for option, weight in zip(options, weights, strict=True):
            rest -= weight
            if rest < 0:
                return option
        return options[-1]

    def shuffled(self, options: Sequence[T]) -> list[T]:
        """The options in random order (Fisher-Yates)."""
        result = list(options)
        for i in range(len(result) - 1, 0, -1):
            j = self.whole(0, i)
            result[i], result[j] = result[j], result[i]
        return result
