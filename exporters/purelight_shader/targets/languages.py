"""The languages that slangc makes, and what is done to its text before anyone reads it."""

from __future__ import annotations

import re
from collections.abc import Callable
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

# Functions that slangc adds, and blocks of GLSL, whose names it makes of their types.
HELPER = re.compile(r"^(?:fn |[^\s#/(=][^\n(=]*[ *&])([a-zA-Z]\w*_\d+)\([^;\n]*$", re.MULTILINE)
BLOCK = re.compile(r"\bbuffer (\w+_\d+) \{")


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
        finish: what is done last to a file that others include, which also takes the prefix.
    """

    target: str
    suffix: str
    kernel: str
    elements: int = 1 << 14
    has_long: bool = True
    unwanted: str = r"(?!)"
    finish: Callable[[str, str], str] = lambda text, _: text


def _cuda(text: str, prefix: str) -> str:
    """Each source file has functions and the buffers' addresses of its own, so that several may
    include the lamp; for NVRTC the addresses have a name that is found."""
    place = text.index("\n", text.rindex("\n#endif") + 1)  # The prelude ends with it.
    prelude, code = text[:place].rstrip(), text[place:].strip("\n")
    found = re.search(rf"^extern \"C\" (__constant__ \w+ {prefix}_buffers;)\n", code, re.MULTILINE)
    if found:
        constant = CUDA_CONSTANT.format(found[1])
        code = code[: found.start()] + constant + code[found.end() :]
    return CUDA.format(prelude=prelude, code=code)


CUDA_CONSTANT = """\
#ifdef __CUDACC_RTC__
extern "C" {0}
#else
{0}
#endif
"""
# Without warnings of unused functions, and of types of the prelude that have newer names.
CUDA = """\
#ifdef __NVCC__
#pragma nv_diagnostic push
#pragma nv_diag_suppress 177, 1444
#endif
#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
#endif
{prelude}

#ifndef __CUDACC_RTC__
namespace
{{
#endif
{code}
#ifndef __CUDACC_RTC__
}}  // namespace
#endif
#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif
#ifdef __NVCC__
#pragma nv_diagnostic pop
#endif
"""

LANGUAGES = {
    "glsl": Language(
        "glsl", "glsl", r"layout\(local_size_x", unwanted=r"#version.*|layout\(row_major\).*"
    ),
    "wgsl": Language("wgsl", "wgsl", r"@compute", has_long=False),
    "hlsl": Language("hlsl", "hlsl", r" *\[numthreads"),
    "metal": Language("metal", "metal", r"\[\[kernel\]\]"),
    "cuda": Language("cuda", "cuh", r"extern \"C\" __global__", finish=_cuda),
}


def files(module: Module, language: Language) -> dict[str, str]:
    """The lamp's functions, and the kernel of the self-test with them, by file name.

    Raises:
        PureLightError: If there is no compiler, or what it gives is not what was expected.
    """
    whole = compile_text(module.text + module.kernel, language.target, stage="compute")
    lamp = own(alone(whole, module, language), module.prefix)
    return {
        f"lamp.{language.suffix}": language.finish(lamp, module.prefix),
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


def own(text: str, prefix: str) -> str:
    """Text in which every name that others see begins with the lamp's prefix.

    So lamps of several prefixes fit into one program. The struct with the buffers that functions of
    Metal take, and that of the addresses which those of CUDA read, are called alike.
    """
    known = {
        "GlobalParams_0": f"{prefix.title()}Buffers",
        "KernelContext_0": f"{prefix.title()}Buffers",
        "SLANG_globalParams": f"{prefix}_buffers",
        "globalParams_0": f"{prefix}_parameters",
    }
    helpers = {name for name in HELPER.findall(text) if not name.startswith(f"{prefix}_")}
    blocks = set(BLOCK.findall(text))
    known |= {name: f"{prefix}_{name}" for name in (*helpers, *blocks)}
    for name, new in known.items():
        text = re.sub(rf"\b{name}\b", new, text)
    return text
