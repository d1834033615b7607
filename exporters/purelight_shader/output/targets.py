"""Every language: what it can take, what is written for it, and what README.md says about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from string import Template

from purelight_format.errors import PureLightError
from purelight_shader.form.store import Store
from purelight_shader.output import buffers
from purelight_shader.output.vectors import SelfTest
from purelight_shader.pages import page
from purelight_shader.targets import cpp, languages, osl, webgl
from purelight_shader.targets.slang_module import Module, module
from purelight_shader.translation import Translation, function

HEAD = """\
// A PureLight luminaire, made by purelight-shader from the bundle
// {digest}
// README.md says what the functions take and give."""

Files = dict[str, bytes]
ELEMENTS = 1 << 14  # Numbers in the arrays of a function on a GPU.
LONGEST = 8 << 20  # Characters of the lamp's functions; real lamps have a hundredth of it.


@dataclass(frozen=True)
class Made:
    """What files with code are made from.

    Arguments:
        target: the language.
        translation: of the lamp.
        test: its golden vectors.
        prefix: of all names.
    """

    target: Target
    translation: Translation
    test: SelfTest
    prefix: str

    @property
    def head(self) -> str:
        """Lines to begin with."""
        return HEAD.format(digest=self.translation.bundle.digest)

    @cached_property
    def module(self) -> Module:
        """The lamp in Slang, once it is known that the language can take it.

        Raises:
            PureLightError: If it cannot.
        """
        programs = self.translation.programs
        names = {network: function(network) for network in programs}
        made = module(programs, names, self.prefix, self.head + "\n")
        self.require_room(made.elements, made.text)
        return made

    def require_room(self, elements: int, text: str) -> None:
        """Refuses a lamp that is too large for compilers or GPUs."""
        title, most = self.target.title, self.target.elements
        if elements > most:
            raise PureLightError(
                f"a network has arrays of {elements:,} numbers, and {title} can take {most:,}; "
                "train a smaller lamp (purelight-size)"
            )
        if len(text) > LONGEST:
            raise PureLightError(
                f"the lamp's functions have {len(text):,} characters, and compilers take at most "
                f"{LONGEST:,}; train a smaller lamp (purelight-size)"
            )


@dataclass(frozen=True)
class Target:
    """A language.

    Arguments:
        title: for people.
        make: the files with code, and the constants.
        calling, selftest: the pages with paragraphs of README.md about them.
        buffers: the page about its buffers.
        store: makes what takes the constants.
        elements: numbers that the arrays of a function may have, all together.
        has_long: whether it has integers of 64 bits.
        reserved: prefixes with which names would be the language's own.
    """

    title: str
    make: Callable[[Made], Files]
    calling: str
    selftest: str = "test_kernel.md.in"
    buffers: str = "buffers.md.in"
    store: Callable[[], Store] = Store
    elements: int = ELEMENTS
    has_long: bool = True
    reserved: frozenset[str] = frozenset()


def _with_buffers(code: dict[str, str], made: Made, *, textures: bool = False) -> Files:
    constants = buffers.constants(made.translation.store, textures=textures)
    return {name: text.encode() for name, text in code.items()} | dict(constants)


def _slang(made: Made) -> Files:
    text = made.module.text
    files = {"lamp.slang": text, "selftest.slang": text + made.module.kernel}
    return _with_buffers(files, made)


def _compiled(name: str) -> Callable[[Made], Files]:
    def make(made: Made) -> Files:
        return _with_buffers(languages.files(made.module, languages.LANGUAGES[name]), made)

    return make


def _webgl(made: Made) -> Files:
    code = webgl.files(made.module) | {"selftest.html": page("webgl.html")}
    return _with_buffers(code, made, textures=True)


def _wgsl(made: Made) -> Files:
    code = languages.files(made.module, languages.LANGUAGES["wgsl"])
    return _with_buffers(code | {"selftest.html": page("wgsl.html")}, made)


def _cpp(made: Made) -> Files:
    given = made.translation
    headers = cpp.files(made.module, given.bundle, given.store, made.prefix, made.head)
    rows, inputs = made.test.inputs.shape
    program = Template(page("selftest.cpp.in")).substitute(
        prefix=made.prefix, rows=rows, inputs=inputs, outputs=made.test.expected.shape[1],
        networks=", ".join(f'"{name}"' for name in made.test.networks),
    )  # fmt: skip
    return _with_buffers(headers | {"selftest.cpp": program}, made)


def _osl(made: Made) -> Files:
    code, elements = osl.files(made.translation, made.prefix, made.head, made.test.inputs)
    made.require_room(elements, code["lamp.osl"])
    texts = {name: text.encode() for name, text in code.items()}
    return texts | osl.tables(made.translation.store)


PAGE = "test_page.md.in"
TARGETS = {
    "slang": Target("Slang", _slang, "slang.md.in"),
    "glsl": Target(
        "GLSL 4.50 (Vulkan)", _compiled("glsl"), "glsl.md.in", reserved=frozenset({"gl"})
    ),
    "webgl": Target(
        "GLSL ES 3.00 (WebGL 2)", _webgl, "webgl.md.in", PAGE, has_long=False,
        reserved=frozenset({"gl", "webgl"}),
    ),
    "wgsl": Target(
        "WGSL (WebGPU)", _wgsl, "wgsl.md.in", PAGE, store=partial(Store, 0), has_long=False
    ),
    "hlsl": Target("HLSL", _compiled("hlsl"), "hlsl.md.in"),
    "metal": Target("Metal", _compiled("metal"), "metal.md.in"),
    "cuda": Target("CUDA", _compiled("cuda"), "cuda.md.in", "test_cuda.md.in"),
    "cpp": Target("C++", _cpp, "cpp.md.in", "test_program.md.in", elements=cpp.ELEMENTS),
    "osl": Target(
        "OSL", _osl, "osl.md.in", "test_osl.md.in", "buffers_osl.md.in", osl.store, has_long=False,
        reserved=osl.WORDS,
    ),
}  # fmt: skip
