"""Linear Rec.709, the one colour space of the format."""

from __future__ import annotations

import numpy as np

# Weights of R, G and B in the luminance (ITU-R BT.709, item 3.2): [3]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
