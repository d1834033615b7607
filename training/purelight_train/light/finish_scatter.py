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
from purelight_train.light.outside_light import Lines, Met, OutsideLight
from purelight_train.light.transmittance import Passing, transmittance_parts

LINES = 1 << 15
LEAST = 2e-3  # of the light: less is none
ANGLES = 12
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
        back = np.maximum(_back(met) - mirrored, 0) if not finish.thin_walled else np.zeros(3)
        ahead = met.weight[(met.ahead > 0) & ~met.mirrored].sum(0) / LINES - through.all.mean(0)
        if finish.thin_walled:
            inner = self._inner(finish, lines, through)
            rest = met.weight.mean(0) - mirrored - through.all.mean(0) - inner
            back, ahead = np.maximum(rest, 0), np.zeros(3)
        spread, exponent = _spread(met, through)
        return replace(
            finish,
            base_color=_rgb(np.array(finish.base_color) + _least(back) / kept),
            diffuse_transmission=_rgb(_least(ahead) / kept),
            spread=spread,
            spread_exponent=exponent,
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


def _back(met: Met) -> Array:
    """Part of the light that a body sends back, or mirrors ahead at once: [3]."""
    result: Array = met.first[(met.first_ahead <= 0) | met.mirrored].sum(0) / len(met.first)
    return result


def _spread(met: Met, through: Passing) -> tuple[float, float]:
    """Which part of what passes leaves the line, and how sharp its lobe is about that."""
    passing = float(through.all.sum())
    if passing < LEAST * LINES:
        return 0.0, 1.0
    share = float(np.clip(through.scattered.sum() / passing, 0, 1))
    weight = met.weight.sum(1) * (met.ahead > 0) * ~met.mirrored
    cosine = float((weight * met.ahead).sum() / max(float(weight.sum()), 1e-9))
    exponent = float(np.clip((2 * cosine - 1) / max(1 - cosine, 1e-4), 0, 1e4))
    return (round(share, 4), round(exponent, 3)) if share > LEAST else (0.0, 1.0)


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
