"""Which arrays live when: those that never meet share memory, and what nobody reads is left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from purelight_shader.form.elements import Array, Expression, Kind, loads
from purelight_shader.form.statements import Product, Program, Rows, Statement


@dataclass
class Slot:
    """Memory that one array after another uses."""

    name: str
    kind: Kind
    size: int


@dataclass(frozen=True)
class Plan:
    """Where the arrays of a program lie.

    Arguments:
        program: without statements whose results nobody reads.
        slots: memory to reserve.
        names: of each array; arrays of one element are variables of their own.
    """

    program: Program
    slots: tuple[Slot, ...]
    names: dict[Array, str]

    @property
    def elements(self) -> int:
        """How many elements all slots have."""
        return sum(slot.size for slot in self.slots)


def target(statement: Statement) -> Array:
    """The array that a statement writes to."""
    if isinstance(statement, (Product, Rows)):
        return statement.target
    source = statement.target.source
    assert isinstance(source, Array)
    return source


def expressions(statement: Statement) -> Iterator[Expression]:
    """What a statement computes with."""
    if isinstance(statement, Product):
        yield from (expression for _, expression in statement.parts)
    elif isinstance(statement, Rows):
        yield statement.row
    else:
        yield statement.expression


def sources(statement: Statement) -> set[Array]:
    """The arrays that a statement reads."""
    found = (load.source for e in expressions(statement) for load in loads(e))
    return {source for source in found if isinstance(source, Array)}


def plan(program: Program) -> Plan:
    """Gives every array its place."""
    kept = _needed(program)
    ports = {port.array: port.array.name for port in (*program.inputs, *program.outputs)}
    names, slots = dict(ports), list[Slot]()
    ends = {array: k for k, s in enumerate(kept) for array in (target(s), *sources(s))}
    free: list[Slot] = []
    placed: dict[Array, Slot] = {}
    for k, statement in enumerate(kept):
        array = target(statement)
        if array not in names and array.size == 1:
            names[array] = f"s{array.name[1:]}"
        elif array not in names:
            placed[array] = _slot(array, free, slots)
            names[array] = placed[array].name
        for done in [a for a in placed if ends[a] == k]:
            free.append(placed.pop(done))
    return Plan(replace(program, statements=tuple(kept)), tuple(slots), names)


def _needed(program: Program) -> list[Statement]:
    """Statements that an output depends on, in order."""
    wanted = {port.array for port in program.outputs}
    kept = []
    for statement in reversed(program.statements):
        if target(statement) in wanted:
            wanted |= sources(statement)
            kept.append(statement)
    return kept[::-1]


def _slot(array: Array, free: list[Slot], slots: list[Slot]) -> Slot:
    """Free memory that is large enough, else the largest made larger, else new memory."""
    fitting = [slot for slot in free if slot.kind is array.kind]
    if not fitting:
        made = Slot(f"m{len(slots)}", array.kind, array.size)
        slots.append(made)
        return made
    enough = [slot for slot in fitting if slot.size >= array.size]
    chosen = min(enough or fitting, key=lambda s: s.size if enough else -s.size)
    chosen.size = max(chosen.size, array.size)
    free.remove(chosen)
    return chosen
