"""Evaluate and sample a PureLight bundle with NumPy and ONNX Runtime."""

from __future__ import annotations

from purelight_format.camera import Camera
from purelight_format.srgb import png
from purelight_onnx.exit_surface import ExitSurface, Hits
from purelight_onnx.lighting import irradiance
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.session import Session
from purelight_onnx.viewer import render, shade

__all__ = [
    "Camera", "ExitSurface", "Hits", "Luminaire", "Session", "irradiance", "png", "render", "shade",
]  # fmt: skip
