"""Luminaires in renderers that run no ONNX: a bundle as shader code, in Slang, OSL or C++.

`write` makes the folder that `purelight-shader` makes; `TARGETS` are the languages.
"""

from purelight_shader.output.folder import contents, write
from purelight_shader.output.targets import TARGETS

__all__ = ["TARGETS", "contents", "write"]
