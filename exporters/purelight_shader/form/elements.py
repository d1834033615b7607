"""What statements are made of: arrays, constants, and expressions of their elements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np


class Kind(Enum):
    """Type of an element: a float of 32 bits, integers of 32 and 64, or a truth value."""

    FLOAT = "float"
    INT = "int"
    LONG = "long"
    BOOL = "bool"


@dataclass(frozen=True, eq=False)
class Array:
    """Memory of a fixed size; every element is written by one statement.

    Arguments:
        name: made by us, never by a file.
        kind: of the elements.
        size: how many.
    """

    name: str
    kind: Kind
    size: int


@dataclass(frozen=True, eq=False)
class Constant:
    """Numbers that a network holds.

    Arguments:
        kind: FLOAT, INT or LONG.
        data: flat.
        place: where they begin in their buffer, in elements; None if they are to be written into
            the code.
        buffer: FLOAT or INT. Integers that are exact as floats lie with these, so that most lamps
            need one buffer only.
        order: among all constants of a lamp.
    """

    kind: Kind
    data: np.ndarray
    place: int | None
    buffer: Kind
    order: int


@dataclass(frozen=True)
class Place:
    """Where an element lies: `offset + strides · counters + computed`.

    Arguments:
        offset: of the first.
        strides: one for each counter of the loops around.
        computed: expressions of kind INT, and what each counts for.
    """

    offset: int
    strides: tuple[int, ...]
    computed: tuple[tuple[Expression, int], ...] = ()


@dataclass(frozen=True)
class Number:
    """A number that is known: of the kind of the expression that it stands in."""

    kind: Kind
    value: float | int | bool


@dataclass(frozen=True)
class Load:
    """An element of an array or a constant."""

    source: Array | Constant
    place: Place

    @property
    def kind(self) -> Kind:
        return self.source.kind


@dataclass(frozen=True)
class Call:
    """An operation on one element of each operand; printers know it by name."""

    operation: str
    kind: Kind
    operands: tuple[Expression, ...]


Expression = Number | Load | Call


def loads(expression: Expression) -> Iterator[Load]:
    """Every load of an expression, those inside places too."""
    if isinstance(expression, Load):
        yield expression
        for inner, _ in expression.place.computed:
            yield from loads(inner)
    elif isinstance(expression, Call):
        for operand in expression.operands:
            yield from loads(operand)


def size(expression: Expression) -> int:
    """How many operations, loads and numbers are written for an expression."""
    if isinstance(expression, Call):
        return 1 + sum(map(size, expression.operands))
    if isinstance(expression, Load):
        return 1 + sum(size(inner) for inner, _ in expression.place.computed)
    return 1


def is_cheap(expression: Expression) -> bool:
    """Whether an expression may be written as often as it is read: a number or a plain load."""
    return size(expression) == 1
