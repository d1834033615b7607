"""Sums over independent batches, and the means and errors that follow however they were parted."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import atomic
from purelight_format.errors import PureLightError

Array = NDArray[np.float64]


@dataclass
class Streams:
    """First and second moments of named arrays over batches of equal cost.

    Arguments:
        batches: so far; paths: emitted in them.
        first, second: sums of the arrays and of their squares, in float64.
    """

    batches: int = 0
    paths: int = 0
    first: dict[str, Array] = field(default_factory=dict)
    second: dict[str, Array] = field(default_factory=dict)

    def add(self, paths: int, arrays: Mapping[str, Array]) -> None:
        """Take a batch in."""
        self.batches, self.paths = self.batches + 1, self.paths + paths
        for name, array in arrays.items():
            self.first[name] = self.first.get(name, 0) + array
            self.second[name] = self.second.get(name, 0) + np.square(array)

    def join(self, other: Streams) -> None:
        """Take in all that another has."""
        self.batches, self.paths = self.batches + other.batches, self.paths + other.paths
        for mine, theirs in ((self.first, other.first), (self.second, other.second)):
            for name, array in theirs.items():
                mine[name] = mine.get(name, 0) + array

    def scaled(self, factor: float) -> Streams:
        """The same with so many times the light."""
        first = {name: array * factor for name, array in self.first.items()}
        second = {name: array * factor**2 for name, array in self.second.items()}
        return Streams(self.batches, self.paths, first, second)

    def mean(self, name: str) -> Array:
        """Mean over the batches."""
        mean: Array = self.first[name] / self.batches
        return mean

    def error(self, name: str) -> Array:
        """Standard error of the mean; infinite for a single batch."""
        if self.batches < 2:
            return np.full_like(self.first[name], math.inf)
        variance = self.second[name] / self.batches - self.mean(name) ** 2
        error: Array = np.sqrt(np.maximum(variance, 0) / (self.batches - 1))
        return error

    def write(self, path: Path) -> None:
        """Write it as .npz, crash-safely."""
        arrays = {f"first.{k}": v for k, v in self.first.items()}
        arrays |= {f"second.{k}": v for k, v in self.second.items()}
        with atomic.replace_file(path) as file:
            np.savez(
                file, allow_pickle=False, counts=np.array([self.batches, self.paths]), **arrays
            )

    @staticmethod
    def read(path: Path) -> Streams:
        """The inverse of `write`.

        Raises:
            PureLightError: the file is not whole.
        """
        try:
            with np.load(path, allow_pickle=False) as data:
                found = {name: data[name] for name in data.files}
            batches, paths = map(int, found.pop("counts"))
        except (OSError, ValueError, KeyError) as error:
            raise PureLightError(f"{path}: unreadable: {error}; delete its folder") from None
        parts: dict[str, dict[str, Array]] = {"first": {}, "second": {}}
        for name, array in found.items():
            kind, _, key = name.partition(".")
            parts[kind][key] = array
        return Streams(batches, paths, parts["first"], parts["second"])


def joined(paths: Iterable[Path]) -> Streams:
    """All parts as one, each read and let go in turn."""
    whole = Streams()
    for path in paths:
        whole.join(Streams.read(path))
    return whole
