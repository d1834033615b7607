"""What all printers share: expressions, places, and loops that look like those of C.

Everything that is printed is made here of names and numbers of ours: no text of a file gets in.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import prod

from purelight_shader.form import memory
from purelight_shader.form.elements import (
    Array,
    Call,
    Constant,
    Expression,
    Kind,
    Load,
    Number,
    Place,
)
from purelight_shader.form.statements import Fold, Loop, Product, Program, Rows, Scan, Statement
from purelight_shader.form.store import FOUR

COUNTERS = tuple(f"k{n}" for n in range(8))
SUM = "sum"
LEAST = {Kind.FLOAT: -3.402823466e38, Kind.INT: -(2**31), Kind.LONG: -(2**63)}


class Printer:
    """Prints one program.

    Arguments:
        program: of one network.

    Attributes:
        types: what each kind is called.
        calls: how each operation is written, `{0}` for its first operand.
        written: constants that the text needs beside it, by their order.
    """

    types: Mapping[Kind, str]
    calls: Mapping[str, str]

    def __init__(self, program: Program) -> None:
        self.plan = memory.plan(program)
        self.program = self.plan.program
        self.lines: list[str] = []
        self.written: dict[int, Constant] = {}
        self._depth = 1

    # Lines

    def add(self, line: str) -> None:
        self.lines.append("    " * self._depth + line)

    @contextmanager
    def block(self, opening: str) -> Iterator[None]:
        """Lines in braces, further in."""
        self.add(opening + " {" if opening else "{")
        self._depth += 1
        yield
        self._depth -= 1
        self.add("}")

    @contextmanager
    def loops(self, extents: Sequence[int], counters: Sequence[str]) -> Iterator[None]:
        """A loop for every extent."""
        if not extents:
            yield
            return
        inner = self.loops(extents[1:], counters[1:])
        with self.block(self.loop(counters[0], extents[0])), inner:
            yield

    def loop(self, counter: str, extent: int) -> str:
        """The head of a loop."""
        return f"for (int {counter} = 0; {counter} < {extent}; {counter} += 1)"

    # Expressions

    def number(self, kind: Kind, value: float) -> str:
        """A literal."""
        raise NotImplementedError

    def constant(self, constant: Constant, index: str) -> str:
        """An element of a constant."""
        raise NotImplementedError

    def expression(self, given: Expression, counters: Sequence[str]) -> str:
        """An expression at the counters' values."""
        if isinstance(given, Number):
            return self.number(given.kind, given.value)
        if isinstance(given, Call):
            operands = [self.expression(operand, counters) for operand in given.operands]
            return self._call(given).format(*operands)
        index = self.index(given.place, counters)
        if isinstance(given.source, Constant):
            return self.constant(given.source, index)
        return self.element(given.source, index)

    def _call(self, given: Call) -> str:
        """How an operation is written; some are written otherwise for integers."""
        kind = given.kind if given.operation == "truncated" else given.operands[-1].kind
        special = f"{given.operation}_{kind.value}"
        return self.calls.get(special, self.calls[given.operation])

    def element(self, array: Array, index: str) -> str:
        """An element of an array; arrays of one are variables."""
        name = self.plan.names[array]
        return name if name[0] == "s" else f"{name}[{index}]"

    def index(self, place: Place, counters: Sequence[str]) -> str:
        """The number that a place comes to."""
        terms = [
            counter if stride == 1 else f"{stride} * {counter}"
            for counter, stride in zip(counters, place.strides, strict=False)
            if stride
        ]
        for inner, stride in place.computed:
            text = self.expression(inner, counters)
            terms.append(text if stride == 1 else f"{stride} * {text}")
        if place.offset or not terms:
            terms.append(str(place.offset))
        return " + ".join(terms)

    # Statements

    def body(self) -> list[str]:
        """The lines of all statements."""
        for slot in self.plan.slots:
            self.add(f"{self.types[slot.kind]} {slot.name}[{slot.size}];")
        for statement in self.program.statements:
            self.statement(statement)
        return self.lines

    def statement(self, statement: Statement) -> None:
        if isinstance(statement, Loop):
            self.assignments(statement)
        elif isinstance(statement, Fold):
            self.fold(statement)
        elif isinstance(statement, Scan):
            self.scan(statement)
        elif isinstance(statement, Product):
            self.product(statement)
        else:
            self.rows(statement)

    def assignments(self, statement: Loop) -> None:
        with self.loops(statement.extents, COUNTERS):
            value = self.expression(statement.expression, COUNTERS)
            self.assign(statement.target, COUNTERS, value)

    def assign(self, target: Load, counters: Sequence[str], value: str) -> None:
        """Writes an element; a variable begins here."""
        assert isinstance(target.source, Array)
        place = self.element(target.source, self.index(target.place, counters))
        begins = "" if "[" in place else f"{self.types[target.kind]} "
        self.add(f"{begins}{place} = {value};")

    def fold(self, statement: Fold) -> None:
        """Sums begin at zero, the largest at the least there is."""
        kind, outer = statement.target.kind, len(statement.outer)
        first = 0 if statement.operation == "add" else LEAST[kind]
        with self.loops(statement.outer, COUNTERS):
            name = self._variable(statement.target)
            self.add(f"{self.types[kind]} {name} = {self.number(kind, first)};")
            with self.loops(statement.inner, COUNTERS[outer:]):
                value = self.expression(statement.expression, COUNTERS)
                self.add(f"{name} = {self._combined(statement, name, value)};")
            if name == SUM:
                self.assign(statement.target, COUNTERS, name)

    def _combined(self, statement: Fold, sum_: str, value: str) -> str:
        kind = statement.target.kind
        operation = self.calls.get(f"{statement.operation}_{kind.value}")
        return (operation or self.calls[statement.operation]).format(sum_, value)

    def _variable(self, target: Load) -> str:
        assert isinstance(target.source, Array)
        name = self.plan.names[target.source]
        return name if name[0] == "s" else SUM

    def scan(self, statement: Scan) -> None:
        *outer, length = statement.extents
        kind, last = statement.target.kind, COUNTERS[len(outer)]
        with self.loops(outer, COUNTERS), self.block(""):
            self.add(f"{self.types[kind]} sum = {self.number(kind, 0)};")
            with self.block(self.loop("n", length)):
                place = f"{length - 1} - n" if statement.reverse else "n"
                self.add(f"int {last} = {place};")
                value = self.expression(statement.expression, COUNTERS)
                following = f"sum = {self.calls['add'].format('sum', value)};"
                if not statement.exclusive:
                    self.add(following)
                    self.assign(statement.target, COUNTERS, "sum")
                else:
                    self.add(f"{self.types[kind]} next = {following[6:]}")
                    self.assign(statement.target, COUNTERS, "sum")
                    self.add("sum = next;")

    def product(self, statement: Product) -> None:
        raise NotImplementedError

    def rows(self, statement: Rows) -> None:
        raise NotImplementedError

    def row_strides(self, statement: Rows) -> list[int]:
        """How far the rows of a table are from each other, for each counter."""
        extents = statement.extents
        width = statement.fours * FOUR
        return [prod(extents[k + 1 :]) * width for k in range(len(extents))]


def total(*terms: tuple[int, str | int]) -> str:
    """The text of a sum of multiples: of counters, none where one has no name, and of one."""
    texts = []
    for factor, name in terms:
        if factor and name == 1:
            texts.append(str(factor))
        elif factor and name:
            texts.append(str(name) if factor == 1 else f"{factor} * {name}")
    return " + ".join(texts) or "0"


def called(text: str, prefix: str, functions: Mapping[str, str]) -> set[str]:
    """Names of ours that a text calls behind a prefix, those inside the functions too.

    Arguments:
        functions: by name; `@` stands for the prefix in them.
    """
    found = set(re.findall(rf"\b{prefix}_(\w+)\(", text))
    while True:
        inner = [functions[name] for name in found & functions.keys()]
        more = {name for body in inner for name in re.findall(r"@_(\w+)\(", body)}
        if more <= found:
            return found
        found |= more
