"""Pictures that know their own noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float64]


@dataclass(frozen=True)
class Picture:
    """Mean of independent unbiased pictures, in W/(m² sr).

    Arguments:
        image: [H, W, 3].
        halves: means of the even and of the odd passes, as noisy as each other.
        error: [H, W, 3] standard error of `image`; zero for a picture without noise.
    """

    image: Image
    halves: tuple[Image, Image]
    error: Image

    @staticmethod
    def exact(image: Image) -> Picture:
        """A picture without noise."""
        return Picture(image, (image, image), np.zeros_like(image))

    def scaled(self, factor: float) -> Picture:
        """All values times a positive number."""
        first, second = (factor * half for half in self.halves)
        return Picture(factor * self.image, (first, second), factor * self.error)

    def blocks(self, side: int) -> Picture:
        """Means over squares of pixels, with less noise; sizes must be multiples of `side`."""
        first, second = (means(half, side) for half in self.halves)
        error = np.sqrt(means(self.error**2, side)) / side
        return Picture(means(self.image, side), (first, second), error)


def mean(pictures: Sequence[Picture]) -> Picture:
    """The mean of independent pictures of the same, as many passes each."""
    image = np.mean([p.image for p in pictures], 0)
    first, second = (np.mean([p.halves[k] for p in pictures], 0) for k in (0, 1))
    error = np.sqrt(np.sum([p.error**2 for p in pictures], 0)) / len(pictures)
    return Picture(image, (first, second), error)


def means(image: NDArray[Any], side: int) -> Image:
    """Means over squares of pixels of [H, W, ...]."""
    height, width = (length // side for length in image.shape[:2])
    result: Image = image.reshape(height, side, width, side, *image.shape[2:]).mean((1, 3))
    return result


@dataclass
class Passes:
    """Streaming sums of independent pictures of equal cost."""

    count: int = 0
    sums: list[Image] = field(default_factory=list)
    squares: Image = field(default_factory=lambda: np.zeros(()))

    def add(self, image: Image) -> None:
        """Take one more pass [H, W, 3] in."""
        if not self.sums:
            self.sums = [np.zeros_like(image), np.zeros_like(image)]
        self.sums[self.count % 2] += image
        self.squares = self.squares + image**2
        self.count += 1

    def picture(self) -> Picture:
        """Mean, halves and standard error of the passes so far, an even number."""
        if self.count < 2 or self.count % 2:
            raise ValueError(f"{self.count} passes; an even number is needed")
        mean = (self.sums[0] + self.sums[1]) / self.count
        variance = np.maximum(self.squares / self.count - mean**2, 0) / (self.count - 1)
        halves = (2 * self.sums[0] / self.count, 2 * self.sums[1] / self.count)
        return Picture(mean, halves, np.sqrt(variance))
