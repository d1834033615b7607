"""A lamp as one module of Slang, and the kernel that proves it with the golden vectors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

from purelight_shader.form.statements import Port, Program
from purelight_shader.printing.slang import VECTORS, SlangPrinter, declarations
from purelight_shader.printing.slang_support import support

TEXTURE_WIDTH = 2048  # Of textures that stand for buffers, in texels; every GPU has as many.


@dataclass(frozen=True)
class Module:
    """The text of a lamp in Slang.

    Arguments:
        text: functions, and declarations of the buffers.
        kernel: a compute kernel that answers the golden vectors, see `selftest`.
        fragment: the same as a fragment shader, for languages whose buffers are textures.
        functions: by network.
        names: all that a host may call or bind, which no compiler must rename.
        elements: of the arrays that the largest function has.
        prefix: what all names begin with.
    """

    text: str
    kernel: str
    fragment: str
    functions: dict[str, str]
    names: tuple[str, ...]
    elements: int
    prefix: str


def module(
    programs: Mapping[str, Program], names: Mapping[str, str], prefix: str, head: str = ""
) -> Module:
    """Prints a lamp.

    Arguments:
        programs: by network.
        names: what to call the function of each, behind the prefix.
        prefix: what all names begin with.
        head: lines to begin with.
    """
    functions = {network: f"{prefix}_{names[network]}" for network in programs}
    printers = [SlangPrinter(p, functions[network], prefix) for network, p in programs.items()]
    texts = [printer.text() for printer in printers]
    public = [*functions.values(), f"{prefix}_floats", f"{prefix}_integers"]
    for printer in printers:
        if len(printer.program.outputs) > 1:
            public += [printer.struct, *(port.name for port in printer.program.outputs)]
    written = {order: held for printer in printers for order, held in printer.written.items()}
    parts = [head, support(texts, prefix, TEXTURE_WIDTH), declarations(written, prefix), *texts]
    elements = max(printer.plan.elements for printer in printers)
    return Module("\n".join(parts), *_kernels(printers), functions, tuple(public), elements, prefix)


def inputs(programs: Mapping[str, Program]) -> int:
    """Numbers in a row of inputs of the self-test: which network, and what it is asked."""
    return 1 + max(sum(port.array.size for port in p.inputs) for p in programs.values())


def outputs(programs: Mapping[str, Program]) -> int:
    """Numbers in a row of its outputs."""
    return max(sum(port.array.size for port in p.outputs) for p in programs.values())


def _kernels(printers: list[SlangPrinter]) -> tuple[str, str]:
    """The self-test as a compute kernel on buffers, and as a fragment on textures."""
    programs = {printer.program.network: printer.program for printer in printers}
    step, room = inputs(programs), outputs(programs)
    answers = ["    switch (int(x[0]))", "    {"]
    for index, printer in enumerate(printers):
        size = sum(port.array.size for port in printer.program.outputs)
        answers += [f"    case {index}:", f"        if (first >= {size}) break;", "        {"]
        answers += [*_case(printer), "        }", "        break;"]
    answers.append("    }")
    compute = [
        "StructuredBuffer<float> test_in;",
        "RWStructuredBuffer<float> test_out;",
        '[shader("compute")]',
        "[numthreads(1, 1, 1)]",
        "void selftest(uint3 id : SV_DispatchThreadID)",
        "{",
        f"    float x[{step}];",
        f"    float y[{room}];",
        f"    for (int k = 0; k < {step}; k += 1) x[k] = test_in[{step} * int(id.x) + k];",
        "    int first = 0;",
        *answers,
        f"    for (int k = 0; k < {room}; k += 1) test_out[{room} * int(id.x) + k] = y[k];",
        "}",
    ]
    fragment = [
        "Texture2D<float4> test_in;",
        '[shader("fragment")]',
        "float4 selftest(float4 place : SV_Position) : SV_Target",
        "{",
        f"    float x[{step}];",
        f"    float y[{_fours(room)}];",
        f"    for (int k = 0; k < {step}; k += 1)",
        "        x[k] = test_in.Load(int3(k >> 2, int(place.x), 0))[k & 3];",
        "    int first = 4 * int(place.y);",
        *answers,
        "    return float4(y[first], y[first + 1], y[first + 2], y[first + 3]);",
        "}",
    ]
    return "\n".join(compute) + "\n", "\n".join(fragment) + "\n"


def _fours(count: int) -> int:
    return -(-count // 4) * 4


def _case(printer: SlangPrinter) -> list[str]:
    """Asks one network and writes down what it answers."""
    place, arguments = 1, []
    for port in printer.program.inputs:
        numbers = ", ".join(f"x[{place + k}]" for k in range(port.array.size))
        arguments.append(f"{VECTORS[port.shape]}({numbers})")
        place += port.array.size
    call, ports = f"{printer.function}({', '.join(arguments)}", printer.program.outputs
    if ports[0].shape not in VECTORS:
        size = prod(ports[0].shape)
        return [
            f"            float r[{size}];",
            f"            {call}, r);",
            f"            for (int k = 0; k < {size}; k += 1) y[k] = r[k];",
        ]
    kind = printer.struct if len(ports) > 1 else VECTORS[ports[0].shape]
    elements = [e for port in ports for e in _elements(port, len(ports) > 1)]
    stores = [f"            y[{k}] = r{e};" for k, e in enumerate(elements)]
    return [f"            {kind} r = {call});", *stores]


def _elements(port: Port, named: bool) -> list[str]:
    field = f".{port.name}" if named else ""
    return [field] if port.array.size == 1 else [f"{field}.{c}" for c in "xyzw"[: port.array.size]]
