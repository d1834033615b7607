"""How near a bundle's transmittance is to what the unlit lamp lets through."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from purelight_mitsuba.scene_file import load_scene
from purelight_train.light.transmittance import transmittance_samples
from purelight_train.truth.backlit import Backlit
from tests.support.fidelity import Figures, Image, Subject

PANELS, GLASS_RAYS = (15.0, 89.9), 16
Lines = tuple[NDArray[np.float32], NDArray[np.float32]]
LINES = 8  # samples of a line that is traced
VIEWS = ((30.0, 10.0), (30.0, -50.0))  # azimuth and elevation


def transmittance(subject: Subject, size: int = 64, spp: int = 512) -> Figures:
    """What the unlit lamp lets through, from two sides, before panels of 15 degrees and more.

    Over the silhouette: the truth's mean, the mean difference from it, and the root of the mean
    square one, each without the truth's noise; that of a straight line that is traced (`line`), so
    that the rest is the network's. Light that a lamp turns by more than 15 degrees is no line's,
    and only the wide panel shows it.
    """
    sights = [_Sight.of(subject, Backlit(subject.description.sphere, size, *v)) for v in VIEWS]
    return {
        f"panel of {angle} degrees": _before_panel(subject, sights, spp, angle) for angle in PANELS
    }


@dataclass(frozen=True)
class _Sight:
    """A view's transmittances over the silhouette, whatever is behind: [N, 3].

    Arguments:
        met: pixels of the silhouette, [size²].
        told: by the bundle.
        traced: of straight lines through the real lamp, twice.
    """

    view: Backlit
    met: NDArray[np.bool_]
    told: Image
    traced: tuple[Image, Image]

    @staticmethod
    def of(subject: Subject, view: Backlit) -> _Sight:
        lines = [view.lines(np.random.default_rng([9, k])) for k in range(GLASS_RAYS)]
        told = np.mean([_passing(subject, *line) for line in lines], 0)
        met = np.isfinite(told).all(1)
        first, second = (_traced(subject, lines, half)[met] for half in range(2))
        return _Sight(view, met, told[met], (first, second))


def _before_panel(subject: Subject, sights: list[_Sight], spp: int, half_angle: float) -> Figures:
    truth: tuple[list[Image], list[Image]] = ([], [])
    for sight in sights:
        view = replace(sight.view, half_angle=half_angle)
        for half, pictures in enumerate(truth):
            lamp = load_scene(subject.scene)
            seen = view.transmitted(lamp, spp // 2, half + 1).reshape(-1, 3)
            pictures.append(seen[sight.met])
    first, second = map(np.concatenate, truth)
    ours = np.concatenate([sight.told for sight in sights])
    one, other = (np.concatenate([sight.traced[half] for sight in sights]) for half in range(2))
    return {
        "truth": float(0.5 * (first + second).mean()),
        "mean": float((ours - 0.5 * (first + second)).mean()),
        "root_mean_square": _root((ours - first) * (ours - second)),
        "line": _root((one - first) * (other - second)),
        "noise": float(0.5 * np.sqrt(((first - second) ** 2).mean())),
    }


def _root(product: Image) -> float:
    """Root of the mean of products of independent errors, which noise may make negative."""
    mean = product.mean()
    return float(np.sign(mean) * np.sqrt(abs(mean)))


def _traced(subject: Subject, lines: list[Lines], half: int) -> Image:
    """Mean transmittance of all lines of a pixel, traced through the real lamp: [N, 3]."""
    parts = [
        transmittance_samples(subject.lamp, *line, seed=2 * (LINES * k + j) + half)
        for k, line in enumerate(lines)
        for j in range(LINES)
    ]
    return np.mean(parts, 0, dtype=np.float64)


def _passing(
    subject: Subject, origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Transmittance of lines; NaN where the lamp is not met: two of [N, 3] -> [N, 3]."""
    hits = subject.surface.intersect(origin, direction)
    result = np.full(origin.shape, np.nan)
    result[hits.index] = subject.transmittance(hits.position, hits.normal, -direction[hits.index])
    return result
