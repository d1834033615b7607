"""A lamp as a C++ header over `purelight.h`, and a program that tests it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from string import Template

import numpy as np

import purelight_cpp
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader.form.elements import Kind
from purelight_shader.form.store import Store
from purelight_shader.pages import page
from purelight_shader.targets.languages import Language, alone
from purelight_shader.targets.slang_module import Module
from purelight_shader.targets.slangc import compile_text

ELEMENTS = 1 << 18  # A megabyte of stack.
CPP = Language("cpp", "h", r"void _selftest\(", elements=ELEMENTS)
PRELUDE = "slang_prelude.h"
END_OF_PRELUDE = (
    "#ifdef SLANG_PRELUDE_NAMESPACE\nusing namespace SLANG_PRELUDE_NAMESPACE;\n#endif\n"
)

# Of each network: what it returns, what it is called with, and how the answer is taken over.
METHODS = {
    "appearance": ("Vec3", "radiance", "Vec3 position, Vec3 normal, Vec3 outgoing"),
    "transparency": ("Vec3", "transmittance", "Vec3 position, Vec3 normal, Vec3 outgoing"),
    "sampler": ("Sample", "sample", "Vec3 point, Vec2 u"),
    "sampler_pdf": ("float", "pdf_solid_angle", "Vec3 point, Vec3 toward"),
    "fast_map": ("", "radiance_map", "Vec3 point, float* result"),
}


METHOD = Template("""\
    ${returned} ${method}(${parameters}) const override
    {
        return generated::taken(generated::asked(${function}, &context_, ${given}));
    }
    void ${method}(std::size_t rows, ${columns}, ${returned}* result) const override
    {
        for (std::size_t k = 0; k < rows; ++k) result[k] = ${method}(${elements});
    }
""")

MAP = Template("""\
    void radiance_map(::purelight::Vec3 point, float* result) const override
    {
        using Map = generated::FixedArray<float, ::purelight::MAP_NUMBERS>;
        auto* map = reinterpret_cast<Map*>(result);
        generated::asked(${function}, &context_, generated::given(point), map);
    }
    using ::purelight::Lamp::radiance_map;
""")

TAKEN = """\
inline ::purelight::Sample taken(${struct} s)
{
    return {taken(s.toward), s.pdf_solid_angle};
}
"""


def files(module: Module, bundle: Bundle, store: Store, prefix: str, head: str) -> dict[str, str]:
    """The headers by name.

    Raises:
        PureLightError: If there is no compiler, or what it gives is not what was expected.
    """
    whole = compile_text(module.text + module.kernel, CPP.target, stage="compute")
    prelude, end, code = alone(whole, module, CPP).partition(END_OF_PRELUDE)
    if not end:
        raise PureLightError("slangc gave cpp of a form that is not known here")
    lamp = Template(page("lamp.h.in")).substitute(
        head=head, prelude=PRELUDE, prefix=prefix, code=code.strip("\n"),
        taken=Template(TAKEN).substitute(struct=_struct(module)) if _struct(module) else "",
        facts=_facts(bundle, module), floats=_floats(store.size(Kind.FLOAT)),
        integers=_integers(store), bindings="\n".join(_bindings(code, prefix)),
        methods="\n".join(_methods(module)), **_sizes(bundle),
    )  # fmt: skip
    return {
        "lamp.h": lamp,
        PRELUDE: prelude,
        purelight_cpp.HEADER: purelight_cpp.source(purelight_cpp.HEADER),
    }


def _struct(module: Module) -> str:
    """What the sampler returns."""
    name = module.functions.get("sampler", "")
    return name.title().replace("_", "")


def _facts(bundle: Bundle, module: Module) -> str:
    about, sphere = bundle.manifest, bundle.manifest.bounding_sphere
    sampler = about.networks.get("sampler")
    has = [str(n in module.functions).lower() for n in ("transparency", "sampler", "fast_map")]
    return ", ".join([
        f'"{bundle.digest}"',
        f"{{{_vector(sphere.center)}, {_float(sphere.radius)}}}",
        _vector(about.flux),
        _float(about.radiance_scale),
        _float(about.r_max),
        _float((sampler.uniform_fraction if sampler else None) or 0.0),
        *has,
    ])  # fmt: skip


def _vector(values: tuple[float, float, float]) -> str:
    return f"{{{', '.join(map(_float, values))}}}"


def _float(value: float) -> str:
    text = f"{np.float32(value):.9g}"
    return f"{text}f" if set(text) & set(".e") else f"{text}.0f"


def _sizes(bundle: Bundle) -> Mapping[str, int]:
    surface = bundle.surface()
    return {"positions": surface.positions.size, "triangles": surface.triangles.size}


def _floats(size: int) -> str:
    """What reads the constants; small lamps have all of them in the code, and no file."""
    return f'::purelight::read_numbers<float>(folder + "/floats.bin", {size})' if size else ""


def _integers(store: Store) -> str:
    size = store.size(Kind.INT)
    return (
        f'::purelight::read_numbers<std::int32_t>(folder + "/integers.bin", {size})' if size else ""
    )


def _bindings(code: str, prefix: str) -> Iterator[str]:
    """Where the buffers lie, for those that the code has a use for."""
    for name, kind in (("floats", "float"), ("integers", "int32_t")):
        if re.search(rf"> {prefix}_{name};", code):
            place = f"        parameters_.{prefix}_{name}"
            four = f"generated::Vector<{kind}, 4>"
            yield f"{place}.data = reinterpret_cast<{four}*>({name}_.data());"
            yield f"{place}.count = {name}_.size() / 4;"


def _methods(module: Module) -> Iterator[str]:
    for network, (returned, method, parameters) in METHODS.items():
        if network in module.functions and returned:
            pairs = [parameter.split() for parameter in parameters.split(", ")]
            names = [name for _, name in pairs]
            yield METHOD.substitute(
                returned=f"::purelight::{returned}" if returned != "float" else returned,
                method=method,
                parameters=", ".join(f"::purelight::{kind} {name}" for kind, name in pairs),
                function=f"generated::{module.functions[network]}",
                given=", ".join(f"generated::given({name})" for name in names),
                columns=", ".join(f"const ::purelight::{kind}* {name}" for kind, name in pairs),
                elements=", ".join(f"{name}[k]" for name in names),
            )
    if "fast_map" in module.functions:
        yield MAP.substitute(function=f"generated::{module.functions['fast_map']}")
