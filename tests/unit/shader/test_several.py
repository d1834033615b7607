"""Several lamps in one program, and programs of several source files."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader import contents, library, write
from purelight_shader.library import build
from purelight_shader.printing.slang_support import support
from purelight_shader.targets.languages import own
from tests.support.compiled import require_compilers

PREFIXES = ("bulb", "torch")
MAIN = """\
#include "bulb/lamp.h"
#include "torch/lamp.h"
float other();
int main()
{
    const auto bulb = bulb_lamp::open("bulb"), torch = torch_lamp::open("torch");
    const purelight::Vec3 up{0, 0, 1};
    return bulb->radiance(up, up, up).x == torch->radiance(up, up, up).x + other() ? 0 : 1;
}
"""
OTHER = """\
#include "torch/lamp.h"
float other() { return torch_lamp::open("torch")->facts.radiance_scale * 0; }
"""
CUDA_MAIN = """\
#include "bulb/lamp.cuh"
#include "torch/lamp.cuh"
__global__ void shade(float3* x) { *x = bulb_radiance(*x, *x, torch_radiance(*x, *x, *x)); }
int other();
int main()
{
    BulbBuffers bulb{};
    TorchBuffers torch{};
    bulb.bulb_floats.count = torch.torch_floats.count = 1;
    cudaMemcpyToSymbol(bulb_buffers, &bulb, sizeof bulb);
    return cudaMemcpyToSymbol(torch_buffers, &torch, sizeof torch) + other();
}
"""
CUDA_OTHER = """\
#include "torch/lamp.cuh"
__global__ void shade_too(float3* x) { *x = torch_radiance(*x, *x, *x); }
int other() { return 0; }
"""
# What stands at the left margin: functions, structs, constants, buffers, blocks, macros.
GLOBAL = re.compile(
    r"^(?:struct |#define |fn |extern \"C\" |[^\s#/{}(][^\n(=;:]*[ *&>])(\w+)(?: ?[;(\[:=]|$)"
    r"|^layout\(.*\bbuffer (\w+)|^\} (\w+);|> (\w+) : (?:array|register)",
    re.MULTILINE,
)


def compiled(folder: Path, words: list[str], sources: dict[str, str]) -> None:
    """Compiles source files together; what the compiler says is the failure."""
    for name, text in sources.items():
        (folder / name).write_text(text)
    done = subprocess.run(
        [*words, *sources, "-o", "program"], cwd=folder, capture_output=True, check=False
    )
    assert (done.returncode, done.stderr.decode()[:2000]) == (0, "")


def test_lamps_in_one_program_of_cpp(alone: Bundle, tmp_path: Path) -> None:
    require_compilers()
    for age, prefix in enumerate(PREFIXES):
        for path in write(alone, "cpp", tmp_path / prefix, prefix):
            os.utime(path, (age, age))  # By its time GCC knows a file that was included before.
    strict = ["-std=c++17", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
    compiled(tmp_path, [*library.compiler(), *strict], {"main.cpp": MAIN, "other.cpp": OTHER})
    subprocess.run(["./program"], cwd=tmp_path, check=True)


def test_lamps_in_one_program_of_cuda(octahedron: Bundle, tmp_path: Path) -> None:
    require_compilers()
    program = shutil.which("nvcc")
    if program is None:
        pytest.skip("nvcc is not installed")
    for prefix in PREFIXES:
        write(octahedron, "cuda", tmp_path / prefix, prefix)
    compiled(tmp_path, [program, "-std=c++17"], {"main.cu": CUDA_MAIN, "other.cu": CUDA_OTHER})


@pytest.mark.parametrize("language", ["glsl", "hlsl", "metal", "cuda", "webgl", "wgsl"])
def test_no_name_is_that_of_another_lamp(language: str, octahedron: Bundle) -> None:
    require_compilers()
    found = []
    for prefix in PREFIXES:
        files = contents(octahedron, language, prefix)
        text = next(data.decode() for name, data in files.items() if name.startswith("lamp."))
        code = text.partition("\nnamespace\n")[2] or text  # Of CUDA, what is behind the prelude.
        found.append({name for match in GLOBAL.findall(code) for name in match if name})
        assert f"{prefix}_radiance" in found[-1]
    assert found[0] & found[1] <= {"SLANG_HLSL_ENABLE_NVAPI", "metal", "int"}


def test_what_slang_adds_gets_the_prefix() -> None:
    text = (
        "__device__ int clamp_0(int x_0, int low_0)\n{\n    return clamp_0(x_0, low_0);\n}\n"
        "float bulb_sign_0(float x_1)\n{\n    float max_0 = bulb_other_0(x_1);\n}\n"
    )
    assert own(text, "bulb") == text.replace("clamp_0", "bulb_clamp_0")


def test_a_prefix_may_be_how_our_own_names_end() -> None:
    """The `o_` of `modulo_long` is no prefix."""
    assert "int64_t o_modulo_long(int64_t a" in support(["x = o_modulo_long(x, 3);"], "o", 2048)


@pytest.mark.parametrize(
    ("language", "prefix"),
    [("glsl", "gl"), ("webgl", "gl"), ("webgl", "webgl"), ("osl", "color"), ("osl", "surface")],
)
def test_a_prefix_is_no_word_of_the_language(
    language: str, prefix: str, octahedron: Bundle
) -> None:
    with pytest.raises(PureLightError, match=f"{prefix}.* is a word of .*choose another"):
        contents(octahedron, language, prefix)


def test_buffers_of_another_bundle_are_refused(alone: Bundle, tmp_path: Path) -> None:
    """Those of a lamp that was trained anew have the same sizes."""
    require_compilers()
    lamp, about = build(alone, tmp_path, ("-O0",)), tmp_path / "lamp.json"
    lamp.close()
    about.write_text(about.read_text().replace(alone.digest, "0" * 64))
    with pytest.raises(PureLightError, match=r"lamp.json: is of another lamp than this code"):
        lamp.open(tmp_path)
    about.unlink()
    lamp.open(tmp_path)  # Buffers may lie alone.
    lamp.close()
