"""One column of a wide output, chosen by each row, without computing the others.

The last layer of a radiance map has hundreds of outputs, and a shading point needs a handful. The
choice is pushed up the graph, through whatever moves, joins or scales columns, until it meets a
layer: of its matrix, only the chosen rows are read. What is above that layer is evaluated once.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.fused import FusedNetwork, Step, Table, Value, affine, columns
from purelight_mitsuba.operators import OPERATORS, Tensor, literal_type, row

Evaluate = Callable[[str], Value]
Plan = Callable[[Evaluate, mi.UInt32], Any]

MOVES = ("Identity", "Reshape", "Transpose")
FUNCTIONS = ("Abs", "Clip", "Exp", "Identity", "Neg", "Relu", "Sigmoid")  # Of one tensor.
ARITHMETIC = ("Add", "Div", "Max", "Min", "Mul", "Sub")


class ColumnPicker:
    """Picks among columns of the first output of a network.

    Arguments:
        network: Its first output is [N, *shape].
        tables: Lists of columns, counted in C order over `shape`, to pick from.
    """

    def __init__(self, network: FusedNetwork, tables: list[np.ndarray]) -> None:
        self._network = network
        self._makers = {name: step for step in network.steps for name in step.outputs}
        self._plans = [self._plan(network.outputs[0], np.asarray(table)) for table in tables]

    def __call__(self, *inputs: Any) -> list[Callable[[mi.UInt32], Any]]:
        """Evaluates what all columns share.

        Arguments:
            inputs: One Dr.Jit array per input of the network.

        Returns:
            For each table, what evaluates its `choice`-th column.
        """
        evaluate = self._network.partly(*inputs)
        return [partial(plan, evaluate) for plan in self._plans]

    def _plan(self, name: str, table: np.ndarray) -> Plan:
        """How to compute columns `table` of a tensor."""
        step = self._makers.get(name)
        if step is not None:
            for make in (self._moved, self._layer, self._joined, self._function, self._arithmetic):
                plan = make(step, table)
                if plan is not None:
                    return plan
        return lambda evaluate, choice: _choose(columns(evaluate(name)).ravel()[table], choice)

    def _moved(self, step: Step, table: np.ndarray) -> Plan | None:
        if step.op not in MOVES:
            return None
        if step.op == "Transpose":
            shape, perm = self._shape(step.inputs[0]), step.attributes["perm"]
            if shape is None or perm[0] != 0:
                return None
            numbers = np.arange(int(np.prod(shape))).reshape(shape)
            table = numbers.transpose([axis - 1 for axis in perm[1:]]).ravel()[table]
        return self._plan(step.inputs[0], table)

    def _layer(self, step: Step, table: np.ndarray) -> Plan | None:
        if step.op not in ("Gemm", "MatMul"):
            return None
        weight, bias = affine(step, self._network)
        picked = Table(np.column_stack([weight, bias])[table].astype(np.float32))

        def plan(evaluate: Evaluate, choice: mi.UInt32) -> Any:
            *weights, total = picked(row([choice]))[0]
            for x, w in zip(columns(evaluate(step.inputs[0])), weights, strict=True):
                total = dr.fma(x, w, total)
            return total

        return plan

    def _joined(self, step: Step, table: np.ndarray) -> Plan | None:
        shapes = [self._shape(name) for name in step.inputs]
        if step.op != "Concat" or any(shape is None or len(shape) != 1 for shape in shapes):
            return None
        ends = np.cumsum([shape[0] for shape in shapes if shape])
        part = np.searchsorted(ends, table, "right")
        if (part != part[0]).any():
            return None
        first = ends[part[0]] - (shapes[part[0]] or (0,))[0]
        return self._plan(step.inputs[part[0]], table - first)

    def _function(self, step: Step, table: np.ndarray) -> Plan | None:
        rest = [self._network.constants.get(name) for name in step.inputs[1:]]
        if step.op not in FUNCTIONS or any(c is not None and c.size != 1 for c in rest):
            return None
        inner, operator = self._plan(step.inputs[0], table), OPERATORS[step.op]
        return lambda evaluate, choice: operator(
            row([inner(evaluate, choice)]), *rest, **step.attributes
        )[0]

    def _arithmetic(self, step: Step, table: np.ndarray) -> Plan | None:
        if step.op not in ARITHMETIC or len(step.inputs) != 2:
            return None
        operands = [self._operand(name, step, table) for name in step.inputs]
        a, b = operands
        if a is None or b is None:
            return None
        operator = OPERATORS[step.op]
        return lambda evaluate, choice: operator(
            row([a(evaluate, choice)]), row([b(evaluate, choice)])
        )[0]

    def _operand(self, name: str, step: Step, table: np.ndarray) -> Plan | None:
        shape = self._shape(step.outputs[0])
        constant = self._network.constants.get(name)
        if constant is None:
            return self._plan(name, table) if shape and shape == self._shape(name) else None
        if constant.size == 1:
            literal = literal_type(constant.dtype)(constant.item())
            return lambda evaluate, choice: literal
        if shape is None or constant.size != np.prod(shape):
            return None
        values = Table(constant.ravel()[table])
        return lambda evaluate, choice: values(row([choice]))[0]

    def _shape(self, name: str) -> tuple[int, ...] | None:
        """The columns' shape of a tensor, where its maker tells."""
        step = self._makers.get(name)
        if step is None:
            return None
        if step.op in ("Gemm", "MatMul"):
            return (len(affine(step, self._network)[1]),)
        if step.op == "Reshape":
            return tuple(int(size) for size in self._network.constants[step.inputs[1]][1:])
        if step.op == "Transpose":
            shape = self._shape(step.inputs[0])
            return shape and tuple(shape[axis - 1] for axis in step.attributes["perm"][1:])
        if step.op in FUNCTIONS:
            return self._shape(step.inputs[0])
        variable = [n for n in step.inputs if n not in self._network.constants]
        shapes = [self._shape(n) for n in variable]
        if step.op == "Concat" and all(shape and len(shape) == 1 for shape in shapes):
            return (sum(shape[0] for shape in shapes if shape),)
        return shapes[0] if step.op in ARITHMETIC and len(set(shapes)) == 1 else None


def _choose(values: Tensor, choice: mi.UInt32) -> Any:
    chosen = values[0]
    for index in range(1, len(values)):
        chosen = dr.select(choice == index, values[index], chosen)
    return chosen
