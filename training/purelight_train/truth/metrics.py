"""How far a picture is from the truth, and how much of that is noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_train.truth.flip import hdr_flip
from purelight_train.truth.picture import Image, Picture

Mask = NDArray[np.bool_]
MAPE_FLOOR, MSE_FLOOR = 0.01, 0.1  # parts of the reference's mean
TILE = 8


def mape(image: Image, reference: Image, mask: Mask | None = None) -> float:
    """Mean of |I - R| / (R + 0.01 mean R) over the pixels of the mask, or over all."""
    image, reference = _chosen(image, mask), _chosen(reference, mask)
    floor = MAPE_FLOOR * reference.mean()
    return float(np.mean(np.abs(image - reference) / (reference + floor)))


def relative_mse(image: Image, reference: Image, mask: Mask | None = None) -> float:
    """Mean of (I - R)² / (R² + (0.1 mean R)²) over the pixels of the mask, or over all."""
    image, reference = _chosen(image, mask), _chosen(reference, mask)
    floor = (MSE_FLOOR * reference.mean()) ** 2
    return float(np.mean((image - reference) ** 2 / (reference**2 + floor)))


def _chosen(image: Image, mask: Mask | None) -> Image:
    return image if mask is None else image[mask]


@dataclass(frozen=True)
class Comparison:
    """A picture against a reference over the pixels of a mask [H, W], noise told from error.

    Both are means of two independent halves a and b. The product (I_a - R_a)(I_b - R_b) has the
    square of the true difference as its mean, for the noise of its factors is independent. Put for
    (I - R)², it takes the measured variance out of a mean square, without bias but for the noise
    of the denominator, which is of fourth order. There is no such identity for |I - R|: MAPE
    without noise is the MAPE of each tile of `TILE` pixels, scaled by the root of what part of the
    tile's mean square is no noise; exact where difference and noise are distributed alike in it.

    The reference's own errors are those of its halves against each other, halved or, for the mean
    square, quartered: what a picture without any error would measure.
    """

    picture: Picture
    reference: Picture
    mask: Mask

    def to_dict(self) -> dict[str, float]:
        """All figures, JSON-ready."""
        return {**self.errors(), **self.noise()}

    def errors(self) -> dict[str, float]:
        """Figures of the picture; `mean` is the relative error of the mean radiance."""
        image, reference, mask = self.picture.image, self.reference.image, self.mask
        return {
            "mape": mape(image, reference, mask),
            "mape_without_noise": self.mape_without_noise(),
            "relative_mse": relative_mse(image, reference, mask),
            "relative_mse_without_noise": self.relative_mse_without_noise(),
            "hdr_flip": hdr_flip(image, reference, mask),
            "mean": float(image[mask].mean() / reference[mask].mean() - 1),
        }

    def noise(self) -> dict[str, float]:
        """Figures of the reference itself, `..._of_reference`."""
        halves = self.reference.halves
        return {
            "mape_of_reference": mape(*halves, self.mask) / 2,
            "relative_mse_of_reference": relative_mse(*halves, self.mask) / 4,
            "hdr_flip_of_reference": hdr_flip(*halves, self.mask),
        }

    def relative_mse_without_noise(self) -> float:
        """Relative mean square error with the variance of both pictures taken out."""
        reference = self.reference.image[self.mask]
        floor = (MSE_FLOOR * reference.mean()) ** 2
        return float(np.mean(self._square()[self.mask] / (reference**2 + floor)))

    def mape_without_noise(self) -> float:
        """MAPE with the share of the noise taken out, tile by tile."""
        reference, mask = self.reference.image, self.mask[..., None]
        floor = MAPE_FLOOR * reference[self.mask].mean()
        return self._without_noise(np.where(mask, 1 / (np.abs(reference) + floor), 0))

    def absolute_over_mean(self) -> float:
        """Mean |I - R| over the mean of R, the noise's share taken out tile by tile."""
        scale = self.mask[..., None] / max(float(self.reference.image[self.mask].mean()), 1e-300)
        return self._without_noise(scale)

    def absolute_noise(self) -> float:
        """The same of the reference against itself."""
        first, second = self.reference.halves
        mean = max(float(self.reference.image[self.mask].mean()), 1e-300)
        return float(np.abs(first - second)[self.mask].mean() / (2 * mean))

    def _without_noise(self, scale: Image) -> float:
        """Mean of |I - R| times a scale [H, W, 1 or 3] that is zero outside of the mask."""
        error = np.abs(self.picture.image - self.reference.image) * scale
        whole = _tiles(error**2)
        part = np.clip(_tiles(self._square() * scale**2), 0, whole)
        share = np.divide(part, whole, out=np.zeros_like(whole), where=whole > 0)
        return float((_tiles(error) * np.sqrt(share)).sum() / (3 * self.mask.sum()))

    def _square(self) -> Image:
        """Unbiased square of the true difference: [H, W, 3], may be negative."""
        (a, b), (c, d) = self.picture.halves, self.reference.halves
        return (a - c) * (b - d)


def _tiles(values: Image) -> Image:
    """Sums over square tiles and channels of [H, W, 3], the last ones cut off by the border."""
    rows, columns = (np.arange(0, n, TILE) for n in values.shape[:2])
    return np.add.reduceat(np.add.reduceat(values.sum(-1), rows, 0), columns, 1)
