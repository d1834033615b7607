"""What glass does with light besides mirroring it and letting it pass: fitted to traced light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from purelight_format.members.finishes import Finish
from purelight_format.reflection import reflectance
from purelight_train.light.finish_fit import reflected
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.outside_light import Lines, OutsideLight
from purelight_train.light.transmittance import Passing, transmittance_parts

LINES = 1 << 15
LEAST = 2e-3  # of the light: less is none
ANGLES = 12
SHARPEST = 1e4  # exponent of a lobe
Array = NDArray[np.float64]


class ScatterFit:
    """Fits the finishes of bodies that light passes through.

    Arguments:
        luminaire: the lamp.
    """

    def __init__(self, luminaire: Luminaire) -> None:
        self._scene, self._surface = luminaire.scene, luminaire.exit_surface
        self._light = OutsideLight(luminaire.scene, luminaire.exit_surface)

    def __call__(self, finish: Finish, triangles: NDArray[np.int64], seed: int) -> Finish:
        """The finish with what its triangles scatter, back and ahead.

        Arguments:
            triangles: those of the exit surface that it is on the front of.
        """
        lines = Lines.to(self._surface, triangles, LINES, seed)
        met = self._light(lines, seed)
        through = transmittance_parts(
            self._scene, lines.origin(self._surface.sphere.radius), -lines.outgoing, seed
        )
        mirrored = _mean_over(lambda c: reflected(finish, c), lines.cosine)
        kept = 1 - _mean_over(lambda c: reflectance(np.array([c]), finish)[0], lines.cosine)
        own, passing = met.weight * ~met.mirrored[:, None], through.all.mean(0)
        ahead = own[met.ahead > 0].sum(0) / LINES - passing
        back = own[met.ahead <= 0].sum(0) / LINES
        if finish.thin_walled:  # Its walls do what is left of this, but for what is inside.
            rest = met.weight.mean(0) - mirrored - passing - self._inner(finish, lines, through)
            ahead, back = np.zeros(3), rest
        spread = _spread(through)
        return replace(
            finish,
            spread=spread,
            scattered_ahead=_rgb(_least(ahead) / kept),
            ahead_exponent=_exponent(own, met.ahead),
            scattered_back=_rgb(_least(back) / kept),
            back_exponent=_exponent(own, -met.ahead),
        )

    def _inner(self, finish: Finish, lines: Lines, through: Passing) -> Array:
        """Even light that the far wall of a hollow mirrors back into it: [3]."""
        start = lines.position - 1e-3 * self._surface.sphere.radius * lines.outgoing
        hits = self._surface.intersect(start.astype(np.float32), -lines.outgoing)
        cosine = np.zeros(LINES)
        own = self._surface.outward_normals()[hits.triangle]
        cosine[hits.index] = np.abs((own * lines.outgoing[hits.index]).sum(1))
        share = reflectance(cosine, finish)
        mirrored = through.all * share / np.maximum(1 - share, 1e-3)
        mirrored[cosine == 0] = 0
        result: Array = mirrored.mean(0)
        return result


def _spread(through: Passing) -> float:
    """Which part of what passes leaves the line."""
    passing = float(through.all.sum())
    if passing < LEAST * LINES:
        return 0.0
    share = float(np.clip(through.scattered.sum() / passing, 0, 1))
    return round(share, 4) if share > LEAST else 0.0


def _exponent(weight: Array, cosine: Array) -> float:
    """The k of a lobe cos^k that has the mean cosine (k + 1) / (k + 2) of light [N, 3]."""
    total = weight.sum(1) * (cosine > 0)
    mean = float((total * cosine).sum() / max(float(total.sum()), 1e-9))
    return round(float(np.clip((2 * mean - 1) / max(1 - mean, 1e-4), 0, SHARPEST)), 3)


def _mean_over(function: Callable[[float], Array], cosine: Array) -> Array:
    """Mean of a function of the cosine over lines, by classes of the cosine: [3]."""
    edges = np.linspace(0, 1, ANGLES + 1)
    count, _ = np.histogram(cosine, edges)
    middle = (edges[:-1] + edges[1:]) / 2
    values = np.array([function(float(c)) for c in middle])
    result: Array = count @ values / count.sum()
    return result


def _least(value: Array) -> Array:
    return np.where(value < LEAST, 0, value)


def _rgb(values: Array) -> tuple[float, float, float]:
    r, g, b = (round(float(x), 5) for x in np.clip(values, 0, 0.95))
    return r, g, b
