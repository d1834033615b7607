"""What a program needs of a language."""

from __future__ import annotations

from collections.abc import Iterator

from purelight_shader.form.elements import Call, Expression, Kind, Load
from purelight_shader.form.memory import expressions, target
from purelight_shader.form.statements import Program


def needs_long(program: Program) -> bool:
    """Whether integers of 64 bits occur."""
    found = (e for s in program.statements for given in expressions(s) for e in _parts(given))
    arrays = (target(statement).kind for statement in program.statements)
    return Kind.LONG in arrays or any(part.kind is Kind.LONG for part in found)


def _parts(expression: Expression) -> Iterator[Expression]:
    yield expression
    if isinstance(expression, Call):
        for operand in expression.operands:
            yield from _parts(operand)
    elif isinstance(expression, Load):
        for inner, _ in expression.place.computed:
            yield from _parts(inner)
