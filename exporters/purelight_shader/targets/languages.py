"""The languages that slangc makes, and what is done to its text before anyone reads it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from purelight_format.errors import PureLightError
from purelight_shader.targets.slang_module import Module
from purelight_shader.targets.slangc import compile_text

TEST_NAMES = ("test_in", "test_out")
TEST_BUFFER = r"test_(?:in|out)_0"
DECLARATION = re.compile(
    rf"^layout\([^)]*\)[^{{}};]*\{{[^}}]*\}} {TEST_BUFFER};\n"  # GLSL, over several lines.
    rf"|^[^;=()\n]*(?:\([^)\n]*\)[^;=()\n]*)*\b{TEST_BUFFER}\b[^;=\n]*;\n",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Language:
    """A language of slangc.

    Arguments:
        target: what slangc calls it.
        suffix: of its files.
        kernel: a pattern of the line with which the self-test's kernel begins.
        elements: numbers that the arrays of a function may have, all together.
        has_long: whether it has integers of 64 bits.
        unwanted: a pattern of lines that a file has no use for which others include.
    """

    target: str
    suffix: str
    kernel: str
    elements: int = 1 << 14
    has_long: bool = True
    unwanted: str = r"(?!)"


LANGUAGES = {
    "glsl": Language(
        "glsl", "glsl", r"layout\(local_size_x", unwanted=r"#version.*|layout\(row_major\).*"
    ),
    "wgsl": Language("wgsl", "wgsl", r"@compute", has_long=False),
    "hlsl": Language("hlsl", "hlsl", r" *\[numthreads"),
    "metal": Language("metal", "metal", r"\[\[kernel\]\]"),
    "cuda": Language("cuda", "cuh", r"extern \"C\" __global__"),
}


def files(module: Module, language: Language) -> dict[str, str]:
    """The lamp's functions, and the kernel of the self-test with them, by file name.

    Raises:
        PureLightError: If there is no compiler, or what it gives is not what was expected.
    """
    whole = compile_text(module.text + module.kernel, language.target, stage="compute")
    return {
        f"lamp.{language.suffix}": alone(whole, module, language),
        f"selftest.{language.suffix}": renamed(whole, (*module.names, *TEST_NAMES)),
    }


def alone(whole: str, module: Module, language: Language) -> str:
    """The functions without the kernel and its buffers."""
    found = list(re.finditer(rf"^{language.kernel}", whole, re.MULTILINE))
    if not found:
        raise PureLightError(f"slangc gave {language.target} of a form that is not known here")
    text = DECLARATION.sub("", whole[: found[-1].start()])
    text = re.sub(rf"^(?:{language.unwanted})\n", "", text, flags=re.MULTILINE)
    return renamed(text, module.names).rstrip() + "\n"


def renamed(text: str, names: tuple[str, ...]) -> str:
    """Public names without the number that slangc puts behind each."""
    for name in names:
        text = re.sub(rf"\b{name}_0\b", name, text)
    return text
