"""Programs as functions of the Open Shading Language: arrays and loops, no vectors of four."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from purelight_shader.form.elements import Constant, Kind
from purelight_shader.form.statements import Product, Program, Rows
from purelight_shader.form.store import FOUR
from purelight_shader.printing.functions import COMMON
from purelight_shader.printing.printer import Printer, total

TYPES = {Kind.FLOAT: "float", Kind.INT: "int", Kind.BOOL: "int"}
TABLES = "Tables"  # The parameter that says where the texture lies.

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
    "exp": "@exp({0})",
    "floor": "floor({0})",
    "from_bool": "({0} ? 1.0 : 0.0)",
    "greater": "({0} > {1})",
    "greater_equal": "({0} >= {1})",
    "int_div": "@quotient({0}, {1})",
    "less": "({0} < {1})",
    "less_equal": "({0} <= {1})",
    "log": "log({0})",
    "max": "max({0}, {1})",
    "min": "min({0}, {1})",
    "mod": "@modulo({0}, {1})",
    "mul": "({0} * {1})",
    "neg": "(-{0})",
    "not": "(!{0})",
    "not_equal": "({0} != {1})",
    "or": "({0} || {1})",
    "place": "@within({0}, {1})",
    "place_from_end": "@place({0}, {1})",
    "reciprocal": "(1.0 / {0})",
    "relu": "max({0}, 0.0)",
    "rest": "@rest({0}, {1})",
    "select": "({0} ? {1} : {2})",
    "sigmoid": "(1.0 / (1.0 + @exp(-{0})))",
    "sign": "@sign({0})",
    "sign_int": "@sign_int({0})",
    "sin": "@sin({0})",
    "sqrt": "sqrt({0})",
    "sub": "({0} - {1})",
    "to_float": "(float)({0})",
    "to_int": "({0})",
    "truncated": "@truncated({0}, {1}, {2})",
    "wrapped_add": "({0} + {1})",
    "wrapped_mul": "({0} * {1})",
    "wrapped_sub": "({0} - {1})",
}


class OslPrinter(Printer):
    """Prints one network as a function of arrays.

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
        """The function; its constants come first in it, as OSL has no others."""
        body = self.body()
        inputs = [f"float {p.array.name}[{p.array.size}]" for p in self.program.inputs]
        outputs = [f"output float {p.array.name}[{p.array.size}]" for p in self.program.outputs]
        names = ", ".join(p.name for p in (*self.program.inputs, *self.program.outputs))
        arguments = ", ".join([f"string {TABLES}", *inputs, *outputs])
        head = [f"// {names}", f"void {self.function}({arguments})", "{"]
        return "\n".join([*head, *self._constants(), *body, "}"]) + "\n"

    def _constants(self) -> list[str]:
        lines = []
        for order, held in sorted(self.written.items()):
            values = ", ".join(number(held.kind, value.item()) for value in held.data)
            kind = TYPES[held.kind]
            lines.append(f"    {kind} c{order}[{held.data.size}] = {{ {values} }};")
        return lines

    def number(self, kind: Kind, value: float) -> str:
        return number(kind, value)

    def constant(self, constant: Constant, index: str) -> str:
        if constant.place is None:
            self.written[constant.order] = constant
            return f"c{constant.order}[{index}]"
        place = f"{constant.place} + {index}" if constant.place else index
        text = f"{self.prefix}_number({TABLES}, {place})"
        return text if constant.kind is Kind.FLOAT else f"(int)({text})"

    def product(self, statement: Product) -> None:
        """Each input is read once and multiplies a column of outputs."""
        blocks, width = statement.blocks, statement.width * FOUR
        inputs = sum(extent for extent, _ in statement.parts)
        name = self.plan.names[statement.target]
        block = "block" if blocks > 1 else ""
        output = total((width, block), (1, "w"))
        with self.loops([blocks][: len(block)], [block]):
            with self.block(self.loop("w", width)):
                begin = "0.0" if statement.bias is None else self.constant(statement.bias, output)
                self.add(f"{name}[{output}] = {begin};")
            start = 0
            for extent, expression in statement.parts:
                counters = ["k0"] if extent > 1 else []
                with self.loops([extent][: len(counters)], counters), self.block(""):
                    self.add(f"float x = {self.expression(expression, counters)};")
                    column = (width, "".join(counters))
                    place = total((width * inputs, block), column, (1, "w"), (start * width, 1))
                    with self.block(self.loop("w", width)):
                        weight = self.constant(statement.weight, place)
                        self.add(f"{name}[{output}] += x * {weight};")
                start += extent

    def rows(self, statement: Rows) -> None:
        """A texel of the texture brings four numbers of a row."""
        name, fours = self.plan.names[statement.target], statement.fours
        counters = [f"k{k}" for k in range(len(statement.extents))]
        strides = self.row_strides(statement)
        with self.loops(statement.extents, counters), self.block(""):
            self.add(f"int row = {self.expression(statement.row, counters)};")
            inner = ["w"] if fours > 1 else []
            with self.loops([fours][: len(inner)], inner):
                terms = [*zip(strides, counters, strict=True), (FOUR, "".join(inner))]
                place = total((fours, "row"), (1, "".join(inner)))
                self._four(statement.table, place, name, terms)

    def _four(self, table: Constant, place: str, name: str, terms: list[tuple[int, str]]) -> None:
        """Four neighbours of a table."""
        if table.place is None:
            for k in range(FOUR):
                value = self.constant(table, f"{FOUR} * ({place}) + {k}")
                self.add(f"{name}[{total(*terms, (k, 1))}] = {value};")
            return
        self.add("float four[4];")
        at = f"{table.place // FOUR} + {place}" if table.place else place
        self.add(f"{self.prefix}_four({TABLES}, {at}, four);")
        for k in range(FOUR):
            self.add(f"{name}[{total(*terms, (k, 1))}] = four[{k}];")


def number(kind: Kind, value: float) -> str:
    """A literal, in brackets if it is negative."""
    if kind is Kind.BOOL:
        return "1" if value else "0"
    if kind is Kind.FLOAT:
        text = f"{np.float32(value):.9g}"
        text = text if set(text) & set(".e") else f"{text}.0"
    else:
        text = "-2147483647 - 1" if value == -(2**31) else str(int(value))
    return f"({text})" if text[0] == "-" else text


FUNCTIONS: Mapping[str, str] = {
    **COMMON,
    # Without derivatives, so that texels come as they are and none are computed.
    "four": """\
void @_four(string Tables, int i, output float four[4])
{
    float alpha = 0.0;
    color texel = texture(Tables, ((i % $WIDTH$) + 0.5) / $WIDTH$.0,
        ((i / $WIDTH$) + 0.5) / $ROWS$.0, 0.0, 0.0, 0.0, 0.0,
        "interp", "closest", "wrap", "clamp", "alpha", alpha);
    four[0] = texel[0];
    four[1] = texel[1];
    four[2] = texel[2];
    four[3] = alpha;
}""",
    "number": """\
float @_number(string Tables, int i)
{
    float four[4];
    @_four(Tables, i / 4, four);
    return four[i % 4];
}""",
    # OSL's own is good to about five digits; its powers of two are exact at whole numbers.
    "exp": """\
float @_exp(float x)
{
    float bounded = x < -87.0 ? -87.0 : (x > 88.37 ? 88.37 : x);
    float n = floor(bounded * 1.44269504 + 0.5);
    float r = (bounded - n * 0.693359375) + n * 0.00021219444;
    float power = 1.0 + r * (1.0 + r * (0.5 + r * (0.166666667 + r * (0.0416666667
        + r * (0.00833333333 + r * 0.00138888889)))));
    return x > 88.37 ? 3.4e38 : power * exp2(n);
}""",
    "within": "int @_within(int i, int last) { return i < 0 ? 0 : (i > last ? last : i); }",
    "place": "int @_place(int i, int last) { return @_within(i < 0 ? i + last + 1 : i, last); }",
    "truncated": """\
int @_truncated(float x, float low, float high)
{
    return (int)(x >= low ? (x <= high ? x : high) : low);
}""",
}
