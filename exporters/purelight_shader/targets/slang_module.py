"""A lamp as one module of Slang, and the kernel that proves it with the golden vectors."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

from purelight_shader.form.statements import Port, Program
from purelight_shader.printing.slang import VECTORS, SlangPrinter, declarations
from purelight_shader.printing.slang_support import support
from purelight_shader.translation import Translation, function

HEADER = """\
// A PureLight luminaire, made by purelight-shader from the bundle
// {digest}
// See README.md for what the functions take and give.
"""


@dataclass(frozen=True)
class Module:
    """The text of a lamp in Slang.

    Arguments:
        text: functions, and declarations of the buffers.
        kernel: a compute kernel that answers the golden vectors, see `selftest`.
        functions: by network.
        names: all that a host may call or bind, which no compiler must rename.
        elements: of the arrays that the largest function has.
    """

    text: str
    kernel: str
    functions: dict[str, str]
    names: tuple[str, ...]
    elements: int


def module(translation: Translation, prefix: str, width: int) -> Module:
    """Prints a lamp.

    Arguments:
        prefix: what all names begin with.
        width: of textures that stand for buffers, in texels.
    """
    programs = translation.programs
    functions = {network: f"{prefix}_{function(network)}" for network in programs}
    printers = [SlangPrinter(p, functions[network], prefix) for network, p in programs.items()]
    texts = [printer.text() for printer in printers]
    names = [*functions.values(), f"{prefix}_floats", f"{prefix}_integers"]
    for printer in printers:
        if len(printer.program.outputs) > 1:
            names += [printer.struct, *(port.name for port in printer.program.outputs)]
    head = HEADER.format(digest=translation.bundle.digest)
    written = {order: held for printer in printers for order, held in printer.written.items()}
    parts = [head, support(texts, prefix, width), declarations(written, prefix), *texts]
    elements = max(printer.plan.elements for printer in printers)
    return Module("\n".join(parts), _kernel(printers), functions, tuple(names), elements)


def inputs(programs: dict[str, Program]) -> int:
    """Numbers in a row of inputs of the self-test: which network, and what it is asked."""
    return 1 + max(sum(port.array.size for port in p.inputs) for p in programs.values())


def outputs(programs: dict[str, Program]) -> int:
    """Numbers in a row of its outputs."""
    return max(sum(port.array.size for port in p.outputs) for p in programs.values())


def _kernel(printers: list[SlangPrinter]) -> str:
    programs = {printer.program.network: printer.program for printer in printers}
    step, room = inputs(programs), outputs(programs)
    cases = []
    for index, printer in enumerate(printers):
        cases += [f"    case {index}:", "    {", *_case(printer), "        break;", "    }"]
    return "\n".join([
        "StructuredBuffer<float> test_in;",
        "RWStructuredBuffer<float> test_out;",
        '[shader("compute")]',
        "[numthreads(1, 1, 1)]",
        "void selftest(uint3 id : SV_DispatchThreadID)",
        "{",
        f"    int i = {step} * int(id.x);",
        f"    int o = {room} * int(id.x);",
        "    switch (int(test_in[i]))",
        "    {",
        *cases,
        "    }",
        "}",
        "",
    ])  # fmt: skip


def _case(printer: SlangPrinter) -> list[str]:
    """Asks one network and writes down what it answers."""
    place, arguments = 1, []
    for port in printer.program.inputs:
        numbers = ", ".join(f"test_in[i + {place + k}]" for k in range(port.array.size))
        arguments.append(f"{VECTORS[port.shape]}({numbers})")
        place += port.array.size
    call, ports = f"{printer.function}({', '.join(arguments)}", printer.program.outputs
    if ports[0].shape not in VECTORS:
        size = prod(ports[0].shape)
        return [
            f"        float r[{size}];",
            f"        {call}, r);",
            f"        for (int k = 0; k < {size}; k += 1) test_out[o + k] = r[k];",
        ]
    kind = printer.struct if len(ports) > 1 else VECTORS[ports[0].shape]
    elements = [e for port in ports for e in _elements(port, len(ports) > 1)]
    stores = [f"        test_out[o + {k}] = r{e};" for k, e in enumerate(elements)]
    return [f"        {kind} r = {call});", *stores]


def _elements(port: Port, named: bool) -> list[str]:
    field = f".{port.name}" if named else ""
    return [field] if port.shape == () else [f"{field}.{c}" for c in "xyzw"[: port.array.size]]
