"""Networks drawn node by node, with every operator, index and axis that the profile may allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random
from typing import Any

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from purelight_format.networks.operators import BOOL, FLOAT, INT32, INT64, OPERATORS, Shape
from purelight_format.networks.profile import IR_VERSION, OPSET
from purelight_format.networks.vectors import SIGNATURES

NUMBERS = {FLOAT: TensorProto.FLOAT, INT32: TensorProto.INT32, INT64: TensorProto.INT64,
           BOOL: TensorProto.BOOL}  # fmt: skip
SIZES = (1, 1, 2, 3, 4, 7)
HEAVY = (1, 3, 60, 600, 6000, 20_000)
VALUES = (0, 1, 2, 3, -1, -2, 5, 2**31 - 1, -(2**31), 2**62)
NODES = 12
WEIGHTS = 200_000


class Graph:
    """A graph that grows; most nodes fit, some do not.

    Arguments:
        rng: draws everything.
        network: whose inputs it has.
        sizes: of layers.
    """

    def __init__(
        self, rng: Random, network: str = "appearance", sizes: Sequence[int] = SIZES
    ) -> None:
        self._rng, self._network, self._sizes = rng, network, sizes
        self._nodes: list[Any] = []
        self._constants: list[Any] = []
        inputs = SIGNATURES[network].inputs
        self._values: dict[str, tuple[np.dtype, Shape]] = {k: (FLOAT, v) for k, v in inputs.items()}

    def model(self) -> bytes:
        """The model, whose outputs are made of the last numbers of the graph."""
        for _ in range(self._rng.randrange(1, NODES)):
            self._grow()
        for name, shape in SIGNATURES[self._network].outputs.items():
            self._output(name, shape)
        signature = SIGNATURES[self._network]
        graph = helper.make_graph(
            self._nodes, "g", [_info(n, s) for n, s in signature.inputs.items()],
            [_info(n, s) for n, s in signature.outputs.items()], self._constants,
        )  # fmt: skip
        opset = [helper.make_opsetid("", OPSET)]
        made = helper.make_model(graph, opset_imports=opset, ir_version=IR_VERSION)
        data: bytes = made.SerializeToString()
        return data

    # Values

    def _any(self, dtype: np.dtype | None = None) -> tuple[str, np.dtype, Shape]:
        """A value of the graph, late ones rather than early ones; converted where need be."""
        names = list(self._values)
        name = names[max(self._rng.randrange(len(names)), self._rng.randrange(len(names)))]
        kind, shape = self._values[name]
        if dtype is not None and kind != dtype and self._rng.random() < 0.97:
            name = self._append("Cast", [name], [(dtype, shape)], to=NUMBERS[dtype])[0]
            kind = dtype
        return name, kind, shape

    def _constant(self, value: Any, dtype: np.dtype = INT64) -> str:
        name = f"c{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(np.asarray(value, dtype), name))
        return name

    def _like(self, shape: Shape, dtype: np.dtype) -> str:
        """A constant that fits a row, or nearly."""
        sizes = [1 if self._rng.random() < 0.3 else size for size in shape]
        cut = self._rng.randrange(len(sizes) + 1)
        kept = tuple(sizes[cut:]) if self._rng.random() < 0.9 else (2, *sizes)
        usual = [v for v in VALUES if dtype == INT64 or abs(v) < 2**31]
        values = [self._rng.choice(usual) for _ in range(int(np.prod(kept, dtype=int)))]
        return self._constant(np.array(values, dtype).reshape(kept), dtype)

    def _append(
        self, op: str, inputs: list[str], outputs: list[tuple[np.dtype, Shape]], **fields: Any
    ) -> list[str]:
        names = [f"v{len(self._nodes)}_{k}" for k in range(len(outputs))]
        self._nodes.append(helper.make_node(op, inputs, names, **fields))
        self._values.update(zip(names, outputs, strict=True))
        return names

    def _axis(self, shape: Shape) -> int:
        """An axis of a tensor with rows, also counted from behind, now and then the rows."""
        rank = len(shape) + 1
        axis = self._rng.randrange(1, rank) if rank > 1 else 1
        axis = axis if self._rng.random() < 0.95 else self._rng.randrange(-1, rank + 1)
        return axis - rank if self._rng.random() < 0.3 else axis

    def _axes(self, shape: Shape) -> list[int]:
        return [self._axis(shape) for _ in range(self._rng.choice((1, 1, 2, 3)))]

    # Nodes

    def _grow(self) -> None:
        op = self._rng.choice(sorted(OPERATORS))
        special: Callable[[str], None] | None = getattr(self, f"_{op.lower()}_node", None)
        if special:
            special(op)
        elif OPERATORS[op].most == 1:
            name, dtype, shape = self._any(BOOL if op == "Not" else None)
            self._append(op, [name], [(dtype, shape)])
        else:
            self._several(op)

    def _several(self, op: str) -> None:
        """Elementwise, of values and constants."""
        dtype = BOOL if op in ("And", "Or") else self._rng.choice((FLOAT, FLOAT, INT32, INT64))
        first, kind, shape = self._any(dtype)
        count = self._rng.randrange(1, 5) if op in ("Max", "Min") else OPERATORS[op].least
        others = [
            self._like(shape, kind) if self._rng.random() < 0.7 else self._any(kind)[0]
            for _ in range(count - 1)
        ]
        found = (
            BOOL if op in ("Equal", "Greater", "GreaterOrEqual", "Less", "LessOrEqual") else kind
        )
        fields = {"fmod": self._rng.randrange(2)} if op == "Mod" else {}
        inputs = [first, *others]
        self._rng.shuffle(inputs)
        self._append(op, inputs, [(found, shape)], **fields)

    def _where_node(self, op: str) -> None:
        condition, _, shape = self._any(BOOL)
        dtype = self._rng.choice((FLOAT, INT64, INT32, BOOL))
        pair = [self._like(shape, dtype), self._any(dtype)[0]]
        self._rng.shuffle(pair)
        self._append(op, [condition, *pair], [(dtype, shape)])

    def _cast_node(self, op: str) -> None:
        name, _, shape = self._any()
        to = self._rng.choice(list(NUMBERS))
        self._append(op, [name], [(to, shape)], to=NUMBERS[to])

    def _clip_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        bounds = [self._constant(v, dtype) if dtype != BOOL else "" for v in (0, 3)]
        self._append(op, [name, *bounds[: self._rng.randrange(3)]], [(dtype, shape)])

    def _gemm_node(self, op: str) -> None:
        name, _, shape = self._any(FLOAT)
        width, size = self._width(shape), shape[-1] if shape else 1
        weight = self._constant(np.ones((width, size)), FLOAT)
        bias = self._constant(np.zeros(width), FLOAT)
        self._append(op, [name, weight, bias], [(FLOAT, (width,))], transB=1)

    def _matmul_node(self, op: str) -> None:
        name, _, shape = self._any(FLOAT)
        width, size = self._width(shape), shape[-1] if shape else 1
        weight = self._constant(np.ones((size, width)), FLOAT)
        self._append(op, [name, weight], [(FLOAT, (*shape[:-1], width))])

    def _width(self, shape: Shape) -> int:
        """Of a layer behind a value; few weights, so that a model stays small."""
        size = shape[-1] if shape else 1
        return min(self._rng.choice(self._sizes), max(7, WEIGHTS // max(size, 1)))

    def _reducesum_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        axes, keep = self._axes(shape), self._rng.randrange(2)
        gone = {axis % (len(shape) + 1) - 1 for axis in axes}
        left = tuple(1 if k in gone else s for k, s in enumerate(shape) if keep or k not in gone)
        self._append(op, [name, self._constant(axes)], [(dtype, left)], keepdims=keep)

    _reducemax_node = _reducesum_node

    def _cumsum_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        axis = self._constant(self._axis(shape), self._rng.choice((INT32, INT64)))
        flags = {k: self._rng.randrange(2) for k in ("exclusive", "reverse")}
        self._append(op, [name, axis], [(dtype, shape)], **flags)

    def _softmax_node(self, op: str) -> None:
        name, dtype, shape = self._any(FLOAT)
        self._append(op, [name], [(dtype, shape)], axis=self._axis(shape))

    def _gather_node(self, op: str) -> None:
        kind = self._rng.choice((INT32, INT64))
        if self._rng.random() < 0.5:
            name, _, shape = self._any(kind)
            table = self._constant(np.ones((8, *self._rng.choice(((), (2,), (1, 3))))), FLOAT)
            width = self._constants[-1].dims[1:]
            self._append(op, [table, name], [(FLOAT, (*shape, *width))])
            return
        name, dtype, shape = self._any()
        axis, count = self._axis(shape), self._rng.randrange(1, 9)
        columns = [self._rng.randrange(-2, 3) for _ in range(count)]
        k = axis % (len(shape) + 1) - 1
        sizes = (*shape[:k], count, *shape[k + 1 :]) if k >= 0 else shape
        self._append(op, [name, self._constant(columns, kind)], [(dtype, sizes)], axis=axis)

    def _gatherelements_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        index, _, sizes = self._any(self._rng.choice((INT32, INT64)))
        self._append(op, [name, index], [(dtype, sizes)], axis=self._axis(shape))

    def _concat_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        axis, count = self._axis(shape), self._rng.randrange(1, 5)
        k = axis % (len(shape) + 1) - 1
        inputs = [name] * count if self._rng.random() < 0.8 else [name, self._any(dtype)[0]]
        sizes = tuple(s * len(inputs) if j == k else s for j, s in enumerate(shape))
        self._append(op, inputs, [(dtype, sizes)], axis=axis)

    def _split_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        axis = self._axis(shape)
        k = axis % (len(shape) + 1) - 1
        size = shape[k] if 0 <= k < len(shape) else 1
        sizes = [1] * size if self._rng.random() < 0.5 else [size]
        outputs = [(dtype, (*shape[:k], s, *shape[k + 1 :])) for s in sizes]
        self._append(op, [name, self._constant(sizes)], outputs, axis=axis)

    def _slice_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        axes = self._axes(shape)[: self._rng.choice((1, 1, 3))]
        kind = self._rng.choice((INT32, INT64))
        far = 2**31 - 1
        starts = [self._rng.choice((0, 0, 1, -1, -far)) for _ in axes]
        ends = [self._rng.choice((far, far, 2, -1)) for _ in axes]
        steps = [self._rng.choice((1, 1, 2, 3)) for _ in axes]
        sizes = list(shape)
        for start, end, axis, step in zip(starts, ends, axes, steps, strict=True):
            k = axis % (len(shape) + 1) - 1
            if 0 <= k < len(sizes):
                sizes[k] = len(range(*slice(start, end, step).indices(sizes[k])))
        given = [self._constant(starts, kind), self._constant(ends, kind), self._constant(axes),
                 self._constant(steps, kind)]  # fmt: skip
        self._append(op, [name, *given], [(dtype, tuple(sizes))])

    def _reshape_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        size = int(np.prod(shape, dtype=int))
        target = self._rng.choice(((size,), (1, size), (size, 1, 1), tuple(reversed(shape)), ()))
        first = self._rng.choice((-1, -1, 0, 1))
        self._append(op, [name, self._constant([first, *target])], [(dtype, target)])

    def _transpose_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        order = list(range(1, len(shape) + 1))
        self._rng.shuffle(order)
        perm = [0, *order] if self._rng.random() < 0.95 else [*order, 0]
        self._append(op, [name], [(dtype, tuple(shape[k - 1] for k in order))], perm=perm)

    def _squeeze_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        ones = [k + 1 for k, size in enumerate(shape) if size == 1] or [1]
        axes = [self._rng.choice(ones) for _ in range(self._rng.choice((1, 1, 2)))]
        left = tuple(s for k, s in enumerate(shape) if k + 1 not in axes)
        self._append(op, [name, self._constant(axes)], [(dtype, left)])

    def _unsqueeze_node(self, op: str) -> None:
        name, dtype, shape = self._any()
        count = self._rng.choice((1, 1, 2))
        axes = [self._rng.randrange(1, len(shape) + count + 1) for _ in range(count)]
        sizes = iter(shape)
        rank = len(shape) + len(set(axes))
        left = tuple(1 if k + 1 in axes else next(sizes, 1) for k in range(rank))
        self._append(op, [name, self._constant(axes)], [(dtype, left)])

    def _output(self, name: str, shape: Shape) -> None:
        """A product of some value, flattened, with as many columns as the output needs."""
        value, _, found = self._any(FLOAT)
        size, width = int(np.prod(found, dtype=int)), int(np.prod(shape, dtype=int))
        flat = self._append("Reshape", [value, self._constant([-1, size])], [(FLOAT, (size,))])[0]
        weight = self._constant(np.ones((size, width)), FLOAT)
        wide = self._append("MatMul", [flat, weight], [(FLOAT, (width,))])[0]
        target = self._constant([-1, *shape])
        self._nodes.append(helper.make_node("Reshape", [wide, target], [name]))


def _info(name: str, shape: Shape) -> Any:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", *shape])


def drawn(rng: Random, network: str = "appearance", sizes: Sequence[int] = SIZES) -> bytes:
    """A model."""
    return Graph(rng, network, sizes).model()
