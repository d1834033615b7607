"""Whether two renderers agree: t-tests on independent passes, corrected for their number."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

if TYPE_CHECKING:  # Mitsuba's variant must be set before it is imported
    import mitsuba as mi

SIGNIFICANCE = 0.01
ROUNDING = 1e-5
BLOCKS = 8


def passes(
    scene: mi.Scene,
    integrator: dict[str, Any] | mi.Integrator,
    spp: int = 64,
    count: int = 16,
    first: int = 0,
) -> np.ndarray:
    """Renders independently: mean of `BLOCKS` x `BLOCKS` blocks of pixels, [count, B, B, 3]."""
    import mitsuba as mi

    made = mi.load_dict(integrator) if isinstance(integrator, dict) else integrator
    images = [
        np.array(mi.render(scene, integrator=made, spp=spp, seed=first + k))[..., :3]
        for k in range(count)
    ]
    height, width, _ = images[0].shape
    shape = (count, BLOCKS, height // BLOCKS, BLOCKS, width // BLOCKS, 3)
    return np.array(images, np.float64).reshape(shape).mean((2, 4))


def agree(ours: np.ndarray, reference: np.ndarray, tolerance: float = 0.01) -> float:
    """Demands that both have the same mean, and that nothing differs significantly."""
    assert np.isfinite(ours).all()
    means = [picture.mean((0, 1, 2)) for picture in (ours, reference)]
    p = p_value(ours, reference)
    print(f"p {p:.3g}, means {means[0] / means[1] - 1}")
    np.testing.assert_allclose(*means, rtol=tolerance)
    assert p > SIGNIFICANCE
    return p


def p_value(a: np.ndarray, b: np.ndarray, rounding: float = ROUNDING) -> float:
    """The smallest p-value of Welch's tests of the whole picture and of every block, by channel.

    Arguments:
        a, b: Independent renderings [passes, B, B, 3].
        rounding: Relative error of their means besides noise.

    Returns:
        The chance, by Sidak's correction, of one so small among so many.
    """
    tests = []
    for x, y in ((a, b), (a.mean((1, 2)), b.mean((1, 2)))):
        parts = [z.var(0, ddof=1) / len(z) for z in (x, y)]
        error = np.sqrt(sum(parts) + (rounding * y.mean(0)) ** 2) + np.finfo(np.float32).tiny
        spread = sum(part**2 / (len(z) - 1) for part, z in zip(parts, (x, y), strict=True))
        freedom = np.where(spread > 0, sum(parts) ** 2 / np.where(spread > 0, spread, 1), np.inf)
        tests.append(2 * stats.t.sf(np.abs(x.mean(0) - y.mean(0)) / error, freedom).ravel())
    p = np.concatenate(tests)
    return float(-np.expm1(p.size * np.log1p(-p.min())))
