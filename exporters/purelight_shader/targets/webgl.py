"""Slang's GLSL as that of WebGL 2 (GLSL ES 3.00): buffers are textures, and there is no layout."""

from __future__ import annotations

import re

from purelight_format.errors import PureLightError
from purelight_shader.targets.languages import TEST_NAMES, Language, renamed
from purelight_shader.targets.slang_module import Module
from purelight_shader.targets.slangc import compile_text

WEBGL = Language("glsl", "webgl.glsl", "", has_long=False)
DEFINES = ("PURELIGHT_TEXTURES",)
HEAD = """\
#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp isampler2D;
"""
SUBSTITUTIONS = (
    (r"^#version.*\n|^#extension.*\n|^layout\(row_major\).*\n", ""),
    (r"^layout\(binding = \d+\)\nuniform (i?)texture2D", r"uniform highp \1sampler2D"),
    (r"^layout\(location = 0\)\nout vec4", "layout(location = 0) out vec4"),
)
MAIN = re.compile(r"^layout\(location = 0\) out vec4 \w+;\n+void main\(\)", re.MULTILINE)
TEST = re.compile(r"^uniform highp sampler2D test_in_0;\n+", re.MULTILINE)


def files(module: Module) -> dict[str, str]:
    """The lamp's functions, and a whole fragment shader of the self-test, by file name.

    Raises:
        PureLightError: If there is no compiler, or what it gives is not what was expected.
    """
    given = compile_text(
        module.text + module.fragment, WEBGL.target, defines=DEFINES, stage="fragment"
    )
    text = embedded(given)
    main = MAIN.search(text)
    if main is None or "texture2D" in text or "buffer " in text:
        raise PureLightError("slangc gave GLSL of a form that is not known here")
    functions = TEST.sub("", text[: main.start()])
    return {
        f"lamp.{WEBGL.suffix}": renamed(functions, module.names).strip() + "\n",
        f"selftest.{WEBGL.suffix}": HEAD + renamed(text, (*module.names, *TEST_NAMES)),
    }


def embedded(text: str) -> str:
    """Text of version 450 as text of ES 3.00, still without its first lines."""
    for pattern, replacement in SUBSTITUTIONS:
        text = re.sub(pattern, replacement, text, flags=re.MULTILINE)
    return text
