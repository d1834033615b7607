"""Trained networks become ONNX graphs, a USD asset, photometry, and with them a bundle."""

from __future__ import annotations

import purelight_train  # noqa: F401 - before Torch: how its threads wait
from purelight_format import lazy

_HOMES = {"Graph": "graph", "Value": "graph", "make_parts": "parts"}
__all__ = list(_HOMES)
__getattr__ = lazy.attributes(__name__, _HOMES)
