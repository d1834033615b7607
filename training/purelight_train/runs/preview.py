"""Small pictures of what a network has learned."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from purelight_format import atomic
from purelight_format.srgb import plain_png
from purelight_train.light.radiance_field import Float


def save_row(path: Path, pictures: list[Float], white: float = 0.0) -> None:
    """Write pictures side by side as a PNG, crash-safely.

    Arguments:
        white: what is shown as the brightest; the 99.5th percentile of the first by default.
    """
    white = white or float(np.percentile(pictures[0].max(-1), 99.5)) or 1.0
    path.parent.mkdir(parents=True, exist_ok=True)
    row = np.concatenate(pictures, axis=1)
    atomic.write_bytes(path, plain_png(np.clip(row / white, 0, 1)))
