"""Every language: what it can take, what is written for it, and what README.md says about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from string import Template
from typing import Any

from purelight_shader.pages import page
from purelight_shader.targets import cpp, languages, webgl
from purelight_shader.targets.slang_module import Module
from purelight_shader.translation import Translation

HEAD = """\
// A PureLight luminaire, made by purelight-shader from the bundle
// {digest}
// README.md says what the functions take and give."""

Files = dict[str, str]
ELEMENTS = 1 << 14  # Numbers in the arrays of a function on a GPU.


@dataclass(frozen=True)
class Made:
    """What files with code are made from.

    Arguments:
        translation: of the lamp.
        module: its text in Slang.
        prefix: of all names.
        about: the content of lamp.json.
    """

    translation: Translation
    module: Module
    prefix: str
    about: dict[str, Any]


@dataclass(frozen=True)
class Target:
    """A language.

    Arguments:
        title: for people.
        make: the files with code.
        calling, selftest: the pages with paragraphs of README.md about them.
        written: constants of at most so many elements stand in the code.
        elements: numbers that the arrays of a function may have, all together.
        has_long: whether it has integers of 64 bits.
        textures: whether buffers are textures.
    """

    title: str
    make: Callable[[Made], Files]
    calling: str
    selftest: str = "test_kernel.md.in"
    written: int = 16
    elements: int = ELEMENTS
    has_long: bool = True
    textures: bool = False


def _slang(made: Made) -> Files:
    text = made.module.text
    return {"lamp.slang": text, "selftest.slang": text + made.module.kernel}


def _compiled(name: str) -> Callable[[Made], Files]:
    return lambda made: languages.files(made.module, languages.LANGUAGES[name])


def _webgl(made: Made) -> Files:
    return webgl.files(made.module) | {"selftest.html": page("webgl.html")}


def _wgsl(made: Made) -> Files:
    return _compiled("wgsl")(made) | {"selftest.html": page("wgsl.html")}


def _cpp(made: Made) -> Files:
    translation, test = made.translation, made.about["selftest"]
    head = HEAD.format(digest=translation.bundle.digest)
    headers = cpp.files(made.module, translation.bundle, translation.store, made.prefix, head)
    program = Template(page("selftest.cpp.in")).substitute(
        prefix=made.prefix, inputs=test["inputs"], outputs=test["outputs"], rows=test["rows"],
        networks=", ".join(f'"{name}"' for name in test["networks"]),
    )  # fmt: skip
    return headers | {"selftest.cpp": program}


PAGE = "test_page.md.in"
TARGETS = {
    "slang": Target("Slang", _slang, "slang.md.in"),
    "glsl": Target("GLSL 4.50 (Vulkan)", _compiled("glsl"), "glsl.md.in"),
    "webgl": Target(
        "GLSL ES 3.00 (WebGL 2)", _webgl, "webgl.md.in", PAGE, has_long=False, textures=True
    ),
    "wgsl": Target("WGSL (WebGPU)", _wgsl, "wgsl.md.in", PAGE, written=0, has_long=False),
    "hlsl": Target("HLSL", _compiled("hlsl"), "hlsl.md.in"),
    "metal": Target("Metal", _compiled("metal"), "metal.md.in"),
    "cuda": Target("CUDA", _compiled("cuda"), "cuda.md.in"),
    "cpp": Target("C++", _cpp, "cpp.md.in", "test_program.md.in", elements=cpp.ELEMENTS),
}
