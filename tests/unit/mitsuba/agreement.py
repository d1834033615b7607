"""A test of whether two renderers agree."""

from __future__ import annotations

import numpy as np

from benchmarks.agreement import SIGNIFICANCE, p_value, passes

__all__ = ["SIGNIFICANCE", "agree", "p_value", "passes"]


def agree(ours: np.ndarray, reference: np.ndarray, tolerance: float = 0.01) -> float:
    """Demands that both have the same mean, and that nothing differs significantly."""
    assert np.isfinite(ours).all()
    means = [picture.mean((0, 1, 2)) for picture in (ours, reference)]
    p = p_value(ours, reference)
    print(f"p {p:.3g}, means {means[0] / means[1] - 1}")
    np.testing.assert_allclose(*means, rtol=tolerance)
    assert p > SIGNIFICANCE
    return p
