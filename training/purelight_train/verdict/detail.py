"""What is kept of a picture's detail: a contrast transfer as opticians measure it of lenses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_train.truth.metrics import Mask
from purelight_train.truth.picture import Image, Picture, means

VISIBLE = 0.1  # of the mean light: neighbourhoods from there on count in full for an eye
FAINT = 0.05  # contrast that is just seen, and counts for half
SURELY = 2.0  # standard errors


@dataclass(frozen=True)
class Detail:
    """How a picture's detail compares with the true one's at one scale.

    Arguments:
        contrast: root of the mean square of the true detail, relative to its neighbourhood.
        kept: part of it that is told, in its place: 1 in a right picture, 0 where all is blurred.
        error: standard error of `kept`.
        faint: whether the true detail is surely too faint to be seen, so that nothing is lost.
    """

    contrast: float
    kept: float
    error: float
    faint: bool = False


@dataclass(frozen=True)
class Scale:
    """Squares of `side` cells, in neighbourhoods of `around` cells a side.

    Arguments:
        eye: whether each neighbourhood that is bright enough counts alike, however strong its
            contrast, as for an eye that adapts; otherwise light counts, and its contrast squared.
    """

    side: int
    around: int
    eye: bool = False


def detail(told: Picture, true: Picture, scale: Scale, where: Mask) -> Detail:
    r"""What is kept of the detail at a scale.

    With c the difference of a square's light (the sum of the channels) from its neighbourhood's,
    over what told and true light are there in the mean, the regression of what is told on the truth

    .. math:: \frac{\sum_n w_n \sum c_S\,c_T}{\sum_n w_n \sum c_{T_a} c_{T_b}}

    over neighbourhoods n. Halves a and b are independent, so noise is in neither sum but by chance,
    and a weight w has no part in the noise of the squares that it is for. Squares and
    neighbourhoods of which less than half counts are left out.

    Arguments:
        where: cells that count, [H, W].
    """
    level, cover = _means(0.5 * (told.image + true.image), where, scale.around)
    halves = [_contrast(half, level, where, scale) for p in (told, true) for half in p.halves]
    counts = level * (cover >= 0.5)
    s, t = 0.5 * (halves[0] + halves[1]), 0.5 * (halves[2] + halves[3])
    square, noise = halves[2] * halves[3], (0.5 * (halves[2] - halves[3])) ** 2
    every, side = (s * t, square, np.ones_like(s)), scale.around // scale.side
    sums = np.zeros((3, *level.shape))
    for these in _checkerboard(s.shape):
        weight = counts
        if scale.eye:
            others = [np.where(these, 0, 2 * each) for each in (s**2, square)]
            weight = _for_an_eye(counts, others[0], others[1], noise)
        sums += weight * [means(np.where(these, each, 0), side) for each in every]
    return _transfer(*sums)


def join(pictures: list[Picture]) -> Picture:
    """Pictures of one width as one, under each other."""
    image, error = (np.concatenate([getattr(p, k) for p in pictures]) for k in ("image", "error"))
    halves = [np.concatenate([p.halves[k] for p in pictures]) for k in (0, 1)]
    return Picture(image, (halves[0], halves[1]), error)


def _checkerboard(shape: tuple[int, ...]) -> tuple[Mask, Mask]:
    """The white and the black squares of a board."""
    white: Mask = np.indices(shape).sum(0) % 2 == 0
    return white, ~white


def _for_an_eye(counts: Image, told: Image, true: Image, noise: Image) -> Image:
    r"""Weights by which all contrast that is bright enough to be seen counts alike.

    .. math:: w = \frac{\min(1, l / l_0)}{\max(\overline{c_S^2}, \overline{c_{T_a} c_{T_b}})
              + c_0^2 + v}

    with l a neighbourhood's light, means over its *other* squares, and v the noise of the truth's
    contrast, which falls with the light.

    Arguments:
        counts: light of neighbourhoods, [h, w], 0 where it does not count.
        told, true: squared contrast of the other squares, [h * side, w * side], twice, and 0 at
            those that the weights are for.
        noise: squared standard error of the truth's contrast, likewise of every square.
    """
    weight, side = np.zeros_like(counts), told.shape[0] // counts.shape[0]
    known = counts > 0
    light = counts[known]
    if not light.size:
        return weight
    strength = np.maximum(means(told, side), means(true, side))[known] + FAINT**2
    per_light = float((means(noise, side)[known] * light).mean())
    weight[known] = np.minimum(light / (VISIBLE * light.mean()), 1) / (strength + per_light / light)
    return weight


def _transfer(common: Image, square: Image, weight: Image) -> Detail:
    """The regression; of detail that is surely too faint to be seen, nothing is lost."""
    total, power = float(weight.sum()), float(square.sum())
    if not total > 0:
        return Detail(0.0, 1.0, 0.0, faint=True)
    contrast, least = float(np.sqrt(max(power, 0) / total)), FAINT**2 * total
    spread = float(np.sqrt((square**2).sum()))  # Neighbourhoods are independent
    if power + SURELY * spread < least:
        return Detail(contrast, 1.0, 0.0, faint=True)
    power = max(power, least)
    kept = float(common.sum()) / power
    error = float(np.sqrt(((common - kept * square) ** 2).sum())) / power
    return Detail(contrast, kept, error)


def _contrast(image: Image, level: Image, where: Mask, scale: Scale) -> Image:
    """Difference of each square from its neighbourhood over the level there."""
    ones = np.ones((scale.around // scale.side,) * 2)
    fine, cover = _means(image, where, scale.side)
    coarse = np.kron(_means(image, where, scale.around)[0], ones)
    spread = np.kron(level, ones)
    known = (spread > 0) & (cover >= 0.5)
    return np.where(known, (fine - coarse) / np.where(known, spread, 1), 0)


def _means(image: Image, where: Mask, side: int) -> tuple[Image, NDArray[np.float64]]:
    """Mean light of the cells that count in each square, and their part of the square."""
    cover = means(where.astype(np.float64), side)
    light = means(np.where(where, image.sum(-1), 0), side)
    return np.where(cover > 0, light / np.where(cover > 0, cover, 1), 0), cover
