"""Pictures from OpenEXR files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray


def read_exr(path: Path) -> NDArray[np.float64]:
    """A picture [H, W, 3]."""
    with OpenEXR.File(str(path)) as file:
        return np.asarray(file.channels()["RGB"].pixels, dtype=np.float64)
