"""Arrays of NumPy on the device, for kernels to look up."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np


def device_array(kind: Any, values: Any) -> Any:
    """Values in memory of Dr.Jit's own: [N] of `kind` for N values.

    On a processor Dr.Jit else takes over NumPy's memory, and gathers rows of it as packets only if
    that happens to be aligned. So the same scene would have other kernels every time, and each
    takes seconds to compile.

    Arguments:
        kind: The array's type, like `mi.Float`, to which they are converted.
        values: Numbers of any shape, which are laid out row by row.
    """
    return dr.opaque(kind(np.ascontiguousarray(values).reshape(-1)))
