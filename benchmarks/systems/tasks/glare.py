r"""Glare: what an eye sees of the lamp, and the unified glare rating that follows.

.. math:: UGR = 8 \log_{10}\left(\frac{0.25}{L_b} \sum_i \frac{L_i^2 \omega_i}{p_i^2}\right)

the sum of CIE 117:1995 over pixels, each of which is a source of its own, where that standard has
one even luminaire: as CIE 232:2019 has it for those that are not even. Such a rating grows as
pixels get smaller, so all scales have pixels of one size. The observer looks straight ahead at the
lamp's azimuth, p is Guth's position index of a pixel above that line. The background's luminance
L_b is stated: nothing of a room is known here, and a difference of two ratings does not depend on
it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.protocol import Image, Subject
from benchmarks.systems.tasks.task import Figures
from benchmarks.systems.tasks.truth import Truth
from benchmarks.systems.tasks.views import View
from purelight_format.camera import Camera
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_format.measures import BoundingSphere
from purelight_format.photometry.ugr import position_index
from purelight_train.truth.picture import Picture

BACKGROUND = 20.0  # L_b, in cd/m²: a dim office


@dataclass(frozen=True)
class Glare(View):
    """An observer below the lamp, `elevation` of a negative angle; see `View`."""

    def figures(self, subject: Subject, picture: Picture, truth: Truth) -> Figures:
        """Ratings, and seen luminance.

        Returns:
            `ugr`, `true_ugr`, `ugr_error` (their difference), `ugr_noise` (how far the ratings of
            the truth's halves are apart, halved; the product of halves stands for L², so that noise
            adds nothing); `luminance_error`: relative, of the mean. None where there is no light.
        """
        camera = self.camera(BoundingSphere((0.0, 0.0, 0.0), 1.0))
        weight = weights(camera)
        told, true = (rating(p.halves, weight) for p in (picture, truth.picture))
        apart = [rating((half, half), weight) for half in truth.picture.halves]
        level = [float((p.image @ LUMINANCE)[truth.mask].mean()) for p in (picture, truth.picture)]
        return {
            "ugr": told,
            "true_ugr": true,
            "background": BACKGROUND,
            "ugr_error": told - true if told is not None and true is not None else None,
            "ugr_noise": abs(apart[0] - apart[1]) / 2 if None not in apart else None,  # type: ignore[operator]
            "luminance_error": level[0] / level[1] - 1 if level[1] > 0 else None,
        }


def weights(camera: Camera) -> NDArray[np.float64]:
    """Solid angle over squared position index of each pixel: [size, size] in sr."""
    _, direction = camera.middle_rays()
    back = camera.axes[2]
    ahead = -np.array([back[0], back[1], 0.0]) / math.hypot(back[0], back[1])
    forward, up = direction @ ahead, direction[:, 2]
    aside = direction @ np.array([-ahead[1], ahead[0], 0.0])
    index = position_index(np.maximum(up / forward, 0.0), aside / forward)
    pixel = (2 * camera.half_width / camera.size) ** 2
    solid_angle = pixel * (-(direction @ back)) ** 3
    return (solid_angle / index**2).reshape(camera.size, camera.size)


def rating(halves: tuple[Image, Image], weight: NDArray[np.float64]) -> float | None:
    """UGR of a picture of independent halves; None where the sum is not positive."""
    first, second = (LUMENS_PER_WATT * (half @ LUMINANCE) for half in halves)
    total = float((first * second * weight).sum())
    return 8 * math.log10(0.25 / BACKGROUND * total) if total > 0 else None
