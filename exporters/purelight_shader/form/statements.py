"""Statements, and the program that they make up."""

from __future__ import annotations

from dataclasses import dataclass

from purelight_shader.form.elements import Array, Constant, Expression, Load

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Loop:
    """`target = expression` for all counters below `extents`."""

    extents: Shape
    target: Load
    expression: Expression


@dataclass(frozen=True)
class Fold:
    """A sum, or the largest, of an expression along the inner counters.

    Arguments:
        operation: `add` or `max`.
        outer: extents of the target's counters.
        inner: extents of those that are folded; in `expression` they come last.
    """

    operation: str
    outer: Shape
    inner: Shape
    target: Load
    expression: Expression


@dataclass(frozen=True)
class Scan:
    """Sums up to each element along the last counter.

    Arguments:
        extents: of all counters.
        exclusive: whether an element's own value is left out.
        reverse: whether sums begin at the end.
    """

    extents: Shape
    target: Load
    expression: Expression
    exclusive: bool
    reverse: bool


@dataclass(frozen=True)
class Product:
    """A matrix times a vector, plus another, in groups of four outputs.

    Arguments:
        target: of `4 · blocks · width` elements.
        parts: extents and expressions of the inputs, one after the other.
        weight: [block, input, width, 4].
        bias: [block, width, 4], or None for zeros.
        blocks: outputs are computed in so many passes over the inputs,
        width: each of so many fours.
    """

    target: Array
    parts: tuple[tuple[int, Expression], ...]
    weight: Constant
    bias: Constant | None
    blocks: int
    width: int


@dataclass(frozen=True)
class Rows:
    """Whole rows of a table, read in fours.

    Arguments:
        extents: of the counters that `row` runs over; rows lie in the target one after another.
        fours: in each row of the table.
        row: which one; of kind INT, and never outside.
    """

    extents: Shape
    target: Array
    table: Constant
    fours: int
    row: Expression


Statement = Loop | Fold | Scan | Product | Rows


@dataclass(frozen=True)
class Port:
    """An input or output of a network: its name in the format, and the array that holds it."""

    name: str
    shape: Shape
    array: Array


@dataclass(frozen=True)
class Program:
    """One network.

    Arguments:
        network: its kind, such as `appearance`.
        statements: in order.
    """

    network: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    statements: tuple[Statement, ...]
