"""Figures of merit: noise is taken out of them without bias, and FLIP is the published one."""

from __future__ import annotations

import numpy as np
import pytest
from flip_evaluator import evaluate
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from purelight_train.truth import flip
from purelight_train.truth.metrics import Comparison, mape, relative_mse
from purelight_train.truth.picture import Passes, Picture

Image = NDArray[np.float64]
PUBLISHED = 0.284882  # The authors' HDR-FLIP of the pictures made below.


def noisy(true: Image, noise: float, rng: np.random.Generator, passes: int = 8) -> Picture:
    sums = Passes()
    for _ in range(passes):
        sums.add(true * (1 + noise * np.sqrt(passes) * rng.normal(size=true.shape)))
    return sums.picture()


def scenery() -> tuple[Image, Image]:
    """A reference of soft blobs, and a picture that is off by spots."""
    rng = np.random.default_rng(0)
    reference = np.exp(gaussian_filter(rng.normal(size=(120, 160, 3)), (4, 4, 0)) * 8)
    spots = gaussian_filter(rng.normal(size=reference.shape), (1, 1, 0))
    return reference, reference * np.exp(0.3 * spots * 3)


def test_passes_know_their_error() -> None:
    rng = np.random.default_rng(0)
    true = np.ones((32, 32, 3))
    picture = noisy(true, 0.1, rng)
    assert np.std(picture.image - true) == pytest.approx(0.1, rel=0.1)
    assert np.sqrt(np.mean(picture.error**2)) == pytest.approx(0.1, rel=0.1)
    a, b = (half - true for half in picture.halves)
    assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.1
    with pytest.raises(ValueError, match="even"):
        Passes(3, [true, true], true).picture()


def test_noise_is_taken_out() -> None:
    """A picture 10 % off, both sides noisy: the mean square without noise is that of the 10 %."""
    rng = np.random.default_rng(1)
    true = np.exp(gaussian_filter(rng.normal(size=(64, 64, 3)), (6, 6, 0)) * 4)
    off = true * (1 + 0.1 * np.sign(rng.normal(size=true.shape)))
    mask = np.ones((64, 64), bool)
    exact = Comparison(Picture.exact(off), Picture.exact(true), mask).to_dict()
    assert exact["mape"] == pytest.approx(exact["mape_without_noise"])
    assert exact["mape_of_reference"] == exact["hdr_flip_of_reference"] == 0
    figures = Comparison(noisy(off, 0.1, rng), noisy(true, 0.07, rng), mask).to_dict()
    assert figures["mape"] > 1.2 * exact["mape"]
    assert figures["relative_mse"] > 2 * exact["relative_mse"]
    assert figures["relative_mse_without_noise"] == pytest.approx(exact["relative_mse"], rel=0.1)
    assert figures["mape_without_noise"] == pytest.approx(exact["mape"], rel=0.2)
    assert figures["mape_of_reference"] == pytest.approx(0.07 * np.sqrt(2 / np.pi), rel=0.15)


def test_nothing_is_left_of_a_right_picture() -> None:
    rng = np.random.default_rng(2)
    true = np.full((64, 64, 3), 2.0)
    comparison = Comparison(noisy(true, 0.1, rng), noisy(true, 0.07, rng), np.ones((64, 64), bool))
    figures = comparison.to_dict()
    assert abs(figures["relative_mse_without_noise"]) < 0.1 * figures["relative_mse"]
    assert figures["mape_without_noise"] < 0.35 * figures["mape"]


def test_only_the_mask_counts() -> None:
    true = np.ones((16, 16, 3))
    wrong = true.copy()
    wrong[:8] = 9
    mask = np.zeros((16, 16), bool)
    mask[8:] = True
    assert mape(wrong, true, mask) == relative_mse(wrong, true, mask) == 0
    figures = Comparison(Picture.exact(wrong), Picture.exact(true), mask).to_dict()
    assert figures["mape_without_noise"] == figures["mean"] == 0


def test_flip_is_the_published_one() -> None:
    """With our exposures, which a mask may choose, and with the library's own."""
    reference, image = scenery()
    assert flip.hdr_flip(image, reference) == pytest.approx(PUBLISHED, abs=1e-6)
    _, published, chosen = evaluate(reference.astype("f4"), image.astype("f4"), "HDR")
    assert published == pytest.approx(PUBLISHED, abs=1e-6)
    first, stops = flip.exposures(reference)
    assert first == pytest.approx(chosen["startExposure"], abs=2e-4)
    assert first + stops == pytest.approx(chosen["stopExposure"], abs=2e-4)


def test_flip_properties() -> None:
    reference, image = scenery()
    whole = flip.hdr_flip(image, reference)
    assert flip.hdr_flip(reference, reference) == 0
    # Exposures follow the reference, so its unit does not matter
    for unit in (1e-20, 1e20):
        assert flip.hdr_flip(unit * image, unit * reference) == pytest.approx(whole, abs=1e-6)
    # The black around a lamp does not count
    mask = np.zeros(reference.shape[:2], bool)
    mask[:60] = True
    dark = np.where(mask[..., None], reference, 0)
    half = flip.hdr_flip(image, dark, mask)
    assert flip.hdr_flip(image, np.where(mask[..., None], reference, 1e-9), mask) == half
    assert flip.exposures(dark)[1] > flip.exposures(dark[mask])[1]
    image[0, 0] = np.nan
    assert np.isnan(flip.hdr_flip(image, reference))


def test_references_of_one_brightness_have_an_exposure() -> None:
    black = np.zeros((8, 8, 3))
    assert flip.hdr_flip(black, black) == 0
    assert flip.hdr_flip(black + 1, black) > 0.9
    assert 0 < flip.hdr_flip(black + 1.1, black + 1) < 0.1
