"""What another compiler says of GLSL and HLSL: glslang, where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from purelight_format.bundle import Bundle
from purelight_shader import contents
from tests.support.compiled import require_compilers

FRAGMENT = """\
layout(location = 0) out vec4 seen;
void main()
{
    vec3 up = vec3(0.0, 0.0, 1.0);
    float pdf = purelight_sample(up, vec2(0.5)).pdf_solid_angle;
    seen = vec4(purelight_radiance(gl_FragCoord.xyz, up, up), pdf);
}
"""
EMBEDDED = "#version 300 es\nprecision highp float;\nprecision highp int;\n"


@pytest.mark.parametrize(
    ("language", "name", "head", "tail", "words"),
    [
        ("glsl", "lamp.glsl", "#version 450\n", FRAGMENT, ("-V", "-S", "frag")),
        ("glsl", "selftest.glsl", "", "", ("-V", "-S", "comp")),
        ("webgl", "lamp.webgl.glsl", EMBEDDED, FRAGMENT, ("-S", "frag")),
        ("hlsl", "selftest.hlsl", "", "", ("-D", "-V", "-S", "comp", "-e", "selftest")),
    ],
)
def test_another_compiler_takes_it(
    language: str,
    name: str,
    head: str,
    tail: str,
    words: tuple[str, ...],
    octahedron: Bundle,
    tmp_path: Path,
) -> None:
    require_compilers()
    program = shutil.which("glslangValidator")
    if program is None:
        pytest.skip("glslangValidator is not installed")
    source = tmp_path / "source"
    source.write_text(head + contents(octahedron, language)[name].decode() + tail)
    output = ["-o", str(tmp_path / "out.spv")] if "-V" in words else []
    done = subprocess.run([program, *words, *output, str(source)], capture_output=True, check=False)
    assert done.returncode == 0, done.stdout.decode()
