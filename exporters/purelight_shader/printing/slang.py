"""Programs as functions of Slang, from which slangc makes GLSL, WGSL, HLSL, Metal, CUDA and C++."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np

from purelight_shader.form.elements import Constant, Kind
from purelight_shader.form.statements import Port, Product, Program, Rows
from purelight_shader.form.store import FOUR
from purelight_shader.printing.printer import Printer, total

TYPES = {Kind.FLOAT: "float", Kind.INT: "int", Kind.LONG: "int64_t", Kind.BOOL: "bool"}
VECTORS = {(): "float", (1,): "float", (2,): "float2", (3,): "float3", (4,): "float4"}
COMPONENTS = "xyzw"

CALLS = {
    "abs": "abs({0})",
    "add": "({0} + {1})",
    "and": "({0} && {1})",
    "asin": "@asin({0})",
    "atan": "@atan({0})",
    "bool_to_int": "({0} ? 1 : 0)",
    "cos": "@cos({0})",
    "div": "({0} / {1})",
    "equal": "({0} == {1})",
    "exp": "exp({0})",
    "floor": "floor({0})",
    "from_bool": "({0} ? 1.0 : 0.0)",
    "greater": "({0} > {1})",
    "greater_equal": "({0} >= {1})",
    "int_div": "@quotient({0}, {1})",
    "int_div_long": "@quotient_long({0}, {1})",
    "less": "({0} < {1})",
    "less_equal": "({0} <= {1})",
    "log": "log({0})",
    "max": "max({0}, {1})",
    "max_float": "@max({0}, {1})",
    "min": "min({0}, {1})",
    "min_float": "@min({0}, {1})",
    "mod": "@modulo({0}, {1})",
    "mod_long": "@modulo_long({0}, {1})",
    "mul": "({0} * {1})",
    "neg": "(-{0})",
    "not": "(!{0})",
    "not_equal": "({0} != {1})",
    "or": "({0} || {1})",
    "place": "clamp({0}, 0, {1})",
    "place_from_end": "@place({0}, {1})",
    "reciprocal": "(1.0 / {0})",
    "relu": "@max({0}, 0.0)",
    "rest": "@rest({0}, {1})",
    "select": "({0} ? {1} : {2})",
    "sigmoid": "(1.0 / (1.0 + exp(-{0})))",
    "sign": "@sign({0})",
    "sign_int": "@sign_int({0})",
    "sign_long": "@sign_long({0})",
    "sin": "@sin({0})",
    "sqrt": "sqrt({0})",
    "sub": "({0} - {1})",
    "to_float": "float({0})",
    "to_int": "int({0})",
    "to_long": "int64_t({0})",
    "truncated": "@truncated({0}, {1}, {2})",
    "truncated_long": "@truncated_long({0}, {1}, {2})",
    "wrapped_add": "int(uint({0}) + uint({1}))",
    "wrapped_mul": "int(uint({0}) * uint({1}))",
    "wrapped_sub": "int(uint({0}) - uint({1}))",
}


class SlangPrinter(Printer):
    """Prints one network as a function.

    Arguments:
        program: of the network.
        function: what to call it.
        prefix: what all names of the lamp begin with.
    """

    types = TYPES

    def __init__(self, program: Program, function: str, prefix: str) -> None:
        super().__init__(program)
        self.function, self.prefix = function, prefix
        self.calls = {name: text.replace("@", f"{prefix}_") for name, text in CALLS.items()}

    def text(self) -> str:
        """The function, after the type that it returns."""
        inputs = [self._vector(port) for port in self.program.inputs]
        for port in self.program.inputs:
            values = ", ".join(_components(port))
            self.add(f"float {port.array.name}[{port.array.size}] = {{ {values} }};")
        for port in self.program.outputs:
            if port.shape in VECTORS:
                self.add(f"float {port.array.name}[{port.array.size}];")
        self.body()
        kind, results, extra = self._results()
        head = f"{kind} {self.function}({', '.join([*inputs, *extra])})"
        lines = [head, "{", *self.lines, *(f"    {line}" for line in results), "}"]
        return "\n".join([*self._struct(), *lines]) + "\n"

    @property
    def struct(self) -> str:
        """What holds the outputs where there are several."""
        return self.function.title().replace("_", "")

    def _vector(self, port: Port) -> str:
        return f"{VECTORS[port.shape]} {port.name}"

    def _struct(self) -> list[str]:
        if len(self.program.outputs) == 1:
            return []
        fields = [f"    {self._vector(port)};" for port in self.program.outputs]
        return [f"struct {self.struct}", "{", *fields, "};"]

    def _results(self) -> tuple[str, list[str], list[str]]:
        """Type of the function, its last lines, and a further argument for what is large."""
        outputs = self.program.outputs
        if len(outputs) > 1:
            lines = [f"{self.struct} result;"]
            lines += [f"result.{port.name} = {_gathered(port)};" for port in outputs]
            return self.struct, [*lines, "return result;"], []
        (port,) = outputs
        if port.shape in VECTORS:
            return VECTORS[port.shape], [f"return {_gathered(port)};"], []
        return "void", [], [f"out float {port.array.name}[{prod(port.shape)}]"]

    def number(self, kind: Kind, value: float) -> str:
        return number(kind, value)

    def constant(self, constant: Constant, index: str) -> str:
        if constant.place is None:
            self.written[constant.order] = constant
            return f"{self.prefix}_c{constant.order}[{index}]"
        reader = "number" if constant.buffer is Kind.FLOAT else "integer"
        text = f"{self.prefix}_{reader}({_plus(constant.place, index)})"
        return text if constant.kind is constant.buffer else f"int({text})"

    def _four(self, constant: Constant, index: str) -> str:
        """Four neighbours of a buffer, counted in fours."""
        assert constant.place is not None
        return f"{self.prefix}_four({_plus(constant.place // FOUR, index)})"

    def product(self, statement: Product) -> None:
        """Each input is read once and multiplies a column of fours."""
        blocks, width = statement.blocks, statement.width
        inputs = sum(extent for extent, _ in statement.parts)
        with self.loops([blocks] if blocks > 1 else [], ["block"]), self.block(""):
            block = "block" if blocks > 1 else ""
            self.add(f"float4 a[{width}];")
            with self.block(self.loop("w", width)):
                self.add(f"a[w] = {self._bias(statement, total((width, block), (1, 'w')))};")
            start = 0
            for extent, expression in statement.parts:
                counters = ["k0"] if extent > 1 else []
                with self.loops([extent][: len(counters)], counters), self.block(""):
                    self.add(f"float x = {self.expression(expression, counters)};")
                    column = (width, "".join(counters))
                    place = total((width * inputs, block), column, (1, "w"), (start * width, 1))
                    with self.block(self.loop("w", width)):
                        self.add(f"a[w] += x * {self._four(statement.weight, place)};")
                start += extent
            with self.block(self.loop("w", width)):
                self._unpack(
                    self.plan.names[statement.target], "a[w]", (4 * width, block), (4, "w")
                )

    def _bias(self, statement: Product, place: str) -> str:
        return "0.0" if statement.bias is None else self._four(statement.bias, place)

    def _unpack(self, name: str, four: str, *terms: tuple[int, str]) -> None:
        """Writes the numbers of a four one after the other."""
        for k, component in enumerate(COMPONENTS):
            self.add(f"{name}[{total(*terms, (k, 1))}] = {four}.{component};")

    def rows(self, statement: Rows) -> None:
        name, fours = self.plan.names[statement.target], statement.fours
        counters = [f"k{k}" for k in range(len(statement.extents))]
        strides = self.row_strides(statement)
        with self.loops(statement.extents, counters), self.block(""):
            self.add(f"int row = {self.expression(statement.row, counters)};")
            inner = ["w"] if fours > 1 else []
            with self.loops([fours][: len(inner)], inner):
                place = total((fours, "row"), (1, "".join(inner)))
                self.add(f"float4 four = {self._four(statement.table, place)};")
                terms = zip([*strides, FOUR], [*counters, "".join(inner)], strict=True)
                self._unpack(name, "four", *terms)


def number(kind: Kind, value: float) -> str:
    """A literal, in brackets if it is negative."""
    if kind is Kind.BOOL:
        return "true" if value else "false"
    if kind is Kind.FLOAT:
        text = f"{np.float32(value):.9g}"
        text = text if set(text) & set(".e") else f"{text}.0"
    elif kind is Kind.INT:
        text = "-2147483647 - 1" if value == -(2**31) else str(int(value))
    else:
        text = f"int64_t({int(value)}LL)" if value > -(2**63) else "-9223372036854775807LL - 1"
    return f"({text})" if text[0] == "-" else text


def declarations(constants: Mapping[int, Constant], prefix: str) -> str:
    """Constants that stand in the code."""
    lines = []
    for order, held in sorted(constants.items()):
        values = ", ".join(number(held.kind, value.item()) for value in held.data)
        kind, name = TYPES[held.kind], f"{prefix}_c{order}"
        lines.append(f"static const {kind} {name}[{held.data.size}] = {{ {values} }};\n")
    return "".join(lines)


def _components(port: Port) -> list[str]:
    if port.array.size == 1:
        return [port.name]
    return [f"{port.name}.{component}" for component in COMPONENTS[: port.array.size]]


def _gathered(port: Port) -> str:
    """The vector that an array of results makes."""
    values = [f"{port.array.name}[{k}]" for k in range(port.array.size)]
    return values[0] if len(values) == 1 else f"{VECTORS[port.shape]}({', '.join(values)})"


def _plus(offset: int, index: str) -> str:
    return f"{offset} + {index}" if offset else index
