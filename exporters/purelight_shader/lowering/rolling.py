"""Pieces that are alike become one loop: what a file unrolled is rolled up again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from purelight_shader.form.elements import Call, Expression, Load, Number, Place

Steps = tuple[int, ...]


def runs(pieces: Sequence[Expression], extents: Sequence[int]) -> Iterator[tuple[int, Steps, int]]:
    """Neighbours that differ by even steps of their offsets only.

    Returns:
        For each run the index of its first piece, the steps of its loads, and how many there are.
    """
    first = 0
    while first < len(pieces):
        steps, last = None, first
        while last + 1 < len(pieces) and extents[last + 1] == extents[first]:
            found = _steps(pieces[last], pieces[last + 1])
            if found is None or (steps is not None and found != steps):
                break
            steps, last = found, last + 1
        yield first, steps or (), last - first + 1
        first = last + 1


def rolled(expression: Expression, steps: Steps) -> Expression:
    """The first expression of a run, with the run as a new first counter."""
    return _rolled(expression, iter(steps))


def _rolled(expression: Expression, steps: Iterator[int]) -> Expression:
    if isinstance(expression, Number):
        return expression
    if isinstance(expression, Call):
        operands = tuple(_rolled(operand, steps) for operand in expression.operands)
        return Call(expression.operation, expression.kind, operands)
    place, step = expression.place, next(steps)
    computed = tuple((_rolled(inner, steps), stride) for inner, stride in place.computed)
    return Load(expression.source, Place(place.offset, (step, *place.strides), computed))


def _steps(a: Expression, b: Expression) -> Steps | None:
    """How far the loads of b are from those of a; None if more is different."""
    if isinstance(a, Load) and isinstance(b, Load):
        if a.source is not b.source or a.place.strides != b.place.strides:
            return None
        if [stride for _, stride in a.place.computed] != [s for _, s in b.place.computed]:
            return None
        inner = [
            _steps(x, y) for (x, _), (y, _) in zip(a.place.computed, b.place.computed, strict=True)
        ]
        return _chained([(b.place.offset - a.place.offset,), *inner])
    if isinstance(a, Call) and isinstance(b, Call):
        alike = (a.operation, a.kind, len(a.operands)) == (b.operation, b.kind, len(b.operands))
        if not alike:
            return None
        return _chained([_steps(x, y) for x, y in zip(a.operands, b.operands, strict=True)])
    return () if a == b else None


def _chained(parts: Sequence[Steps | None]) -> Steps | None:
    if any(part is None for part in parts):
        return None
    return tuple(step for part in parts if part is not None for step in part)
