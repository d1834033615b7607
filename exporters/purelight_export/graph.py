"""A small ONNX builder: values that one can calculate with, written as few, plain nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from onnx import TensorProto, helper, numpy_helper

OPSET = 18
IR_VERSION = 10
ROWS = "N"


@dataclass(frozen=True, eq=False)
class Value:
    """A tensor of a graph: `shape` leaves out the rows, except for constants, which have none."""

    graph: Graph
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype

    def __add__(self, other: Any) -> Value:
        return self.graph.binary("Add", self, other)

    def __radd__(self, other: Any) -> Value:
        return self.graph.binary("Add", other, self)

    def __sub__(self, other: Any) -> Value:
        return self.graph.binary("Sub", self, other)

    def __rsub__(self, other: Any) -> Value:
        return self.graph.binary("Sub", other, self)

    def __mul__(self, other: Any) -> Value:
        return self.graph.binary("Mul", self, other)

    def __rmul__(self, other: Any) -> Value:
        return self.graph.binary("Mul", other, self)

    def __truediv__(self, other: Any) -> Value:
        return self.graph.binary("Div", self, other)

    def __rtruediv__(self, other: Any) -> Value:
        return self.graph.binary("Div", other, self)

    def __neg__(self) -> Value:
        return self.graph.unary("Neg", self)

    def __abs__(self) -> Value:
        return self.graph.unary("Abs", self)

    def __invert__(self) -> Value:
        return self.graph.unary("Not", self)

    def __lt__(self, other: Any) -> Value:
        return self.graph.binary("Less", self, other, np.bool_)

    def __le__(self, other: Any) -> Value:
        return self.graph.binary("LessOrEqual", self, other, np.bool_)

    def __gt__(self, other: Any) -> Value:
        return self.graph.binary("Greater", self, other, np.bool_)

    def __ge__(self, other: Any) -> Value:
        return self.graph.binary("GreaterOrEqual", self, other, np.bool_)

    def __and__(self, other: Value) -> Value:
        return self.graph.binary("And", self, other, np.bool_)


class Graph:
    """Collects the nodes of one network; equal nodes and equal constants are written once.

    Every computed tensor has the rows as its first axis, which stays implicit here. It is the
    `purelight_format.namespace.Namespace` of its values.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._inputs: list[Value] = []
        self._outputs: list[Value] = []
        self._constants: dict[tuple[Any, ...], tuple[Value, np.ndarray]] = {}
        self._nodes: dict[tuple[Any, ...], tuple[Any, list[Value]]] = {}
        self._count = 0

    # Tensors

    def input(self, name: str, *shape: int) -> Value:
        """Declares a float32 input of shape [N, *shape]."""
        value = Value(self, name, shape, np.dtype(np.float32))
        self._inputs.append(value)
        return value

    def output(self, name: str, value: Value) -> None:
        """Names a value as an output of the network."""
        key = ("Identity", name)
        self._nodes[key] = (
            helper.make_node("Identity", [value.name], [name]),
            [renamed := Value(self, name, value.shape, value.dtype)],
        )
        self._outputs.append(renamed)

    def constant(self, array: Any, dtype: Any = np.float32) -> Value:
        """Returns the initializer that holds this array.

        A number has shape [1, 1]: against [N, 1], ONNX Runtime is 20 times slower with less.
        """
        data = np.asarray(array, dtype)
        if data.ndim == 0:
            return self._initializer(data.reshape(1, 1), (1,))
        return self._initializer(data)

    def _initializer(self, data: np.ndarray, shape: tuple[int, ...] | None = None) -> Value:
        row = data.shape if shape is None else shape
        key = (data.dtype.str, data.shape, row, data.tobytes())
        if key not in self._constants:
            value = Value(self, f"c{len(self._constants)}", row, data.dtype)
            self._constants[key] = (value, data.copy())
        return self._constants[key][0]

    def vector(self, values: Sequence[float], like: Value) -> Value:
        """Returns a constant vector [D] of the type of a value."""
        return self.constant(values, like.dtype)

    def least(self, like: Value) -> float:
        """Returns the shortest length that vectors are divided by."""
        return 1e-20

    def _axes(self, axes: Sequence[int]) -> Value:
        return self._initializer(np.asarray(axes, np.int64))

    # Nodes

    def node(
        self,
        op: str,
        inputs: Sequence[Value],
        shapes: Sequence[tuple[int, ...]],
        dtype: Any,
        **attributes: Any,
    ) -> list[Value]:
        """Adds a node, or finds the same one, and returns its outputs."""
        names = [value.name for value in inputs]
        key = (op, *names, *shapes, *((k, repr(v)) for k, v in sorted(attributes.items())))
        if key not in self._nodes:
            outputs = [self._fresh(op, shape, dtype) for shape in shapes]
            proto = helper.make_node(op, names, [o.name for o in outputs], **attributes)
            self._nodes[key] = (proto, outputs)
        return self._nodes[key][1]

    def _fresh(self, op: str, shape: tuple[int, ...], dtype: Any) -> Value:
        self._count += 1
        return Value(self, f"{op.lower()}_{self._count}", shape, np.dtype(dtype))

    def unary(self, op: str, x: Value) -> Value:
        """Applies an elementwise operator of one operand."""
        return self.node(op, [x], [x.shape], x.dtype)[0]

    def binary(self, op: str, a: Any, b: Any, dtype: Any = None) -> Value:
        """Applies an elementwise operator of two operands; plain numbers become constants."""
        kind = next(v.dtype for v in (a, b) if isinstance(v, Value))
        a, b = (v if isinstance(v, Value) else self.constant(v, kind) for v in (a, b))
        shape = np.broadcast_shapes(a.shape, b.shape)
        return self.node(op, [a, b], [shape], dtype or kind)[0]

    def where(self, condition: Value, a: Any, b: Any) -> Value:
        """Returns a where the condition holds, b elsewhere."""
        kind = next((v.dtype for v in (a, b) if isinstance(v, Value)), np.float32)
        a, b = (v if isinstance(v, Value) else self.constant(v, kind) for v in (a, b))
        shape = np.broadcast_shapes(condition.shape, a.shape, b.shape)
        return self.node("Where", [condition, a, b], [shape], kind)[0]

    def asin(self, x: Value) -> Value:
        return self.unary("Asin", x)

    def atan(self, x: Value) -> Value:
        return self.unary("Atan", x)

    def cos(self, x: Value) -> Value:
        return self.unary("Cos", x)

    def sin(self, x: Value) -> Value:
        return self.unary("Sin", x)

    def exp(self, x: Value) -> Value:
        return self.unary("Exp", x)

    def log(self, x: Value) -> Value:
        return self.unary("Log", x)

    def floor(self, x: Value) -> Value:
        return self.unary("Floor", x)

    def relu(self, x: Value) -> Value:
        return self.unary("Relu", x)

    def sigmoid(self, x: Value) -> Value:
        return self.unary("Sigmoid", x)

    def sign(self, x: Value) -> Value:
        return self.unary("Sign", x)

    def sqrt(self, x: Value) -> Value:
        return self.unary("Sqrt", x)

    def minimum(self, a: Any, b: Any) -> Value:
        return self.binary("Min", a, b)

    def maximum(self, a: Any, b: Any) -> Value:
        return self.binary("Max", a, b)

    def clip(self, x: Value, low: float, high: float) -> Value:
        """Limits x to [low, high]."""
        ends = [self._initializer(np.asarray(end, x.dtype)) for end in (low, high)]
        return self.node("Clip", [x, *ends], [x.shape], x.dtype)[0]

    def cast(self, x: Value, dtype: Any) -> Value:
        """Converts to another element type (a float is truncated towards zero)."""
        to = helper.np_dtype_to_tensor_dtype(np.dtype(dtype))
        return self.node("Cast", [x], [x.shape], dtype, to=to)[0]

    def softmax(self, x: Value) -> Value:
        return self.node("Softmax", [x], [x.shape], x.dtype, axis=1)[0]

    def sum(self, x: Value) -> Value:
        """Sums each row: [N, D] to [N, 1]."""
        return self.node("ReduceSum", [x, self._axes([1])], [(1,)], x.dtype, keepdims=1)[0]

    def cumulative_sum(self, x: Value, *, exclusive: bool = False) -> Value:
        """Sums each row up to each column, without the column itself if `exclusive`."""
        axis = self._initializer(np.asarray(1, np.int64))
        return self.node("CumSum", [x, axis], [x.shape], x.dtype, exclusive=int(exclusive))[0]

    def linear(self, x: Value, weight: Any, bias: Any) -> Value:
        """Returns x weight' + bias, weight [out, in]."""
        matrix, offset = self.constant(weight), self.constant(bias)
        if matrix.shape[1:] != x.shape or offset.shape != matrix.shape[:1]:
            raise ValueError(f"weight {matrix.shape}, bias {offset.shape}, but input {x.shape}")
        return self.node("Gemm", [x, matrix, offset], [matrix.shape[:1]], x.dtype, transB=1)[0]

    def gather(self, table: Value, index: Value) -> Value:
        """Looks up rows of a constant table: index [N, D] into [T, F] gives [N, D, F]."""
        return self.node("Gather", [table, index], [index.shape + table.shape[1:]], table.dtype)[0]

    def gather_columns(self, x: Value, columns: Sequence[int]) -> Value:
        """Picks columns of each row in any order: [N, D] to [N, len(columns)]."""
        index = self._initializer(np.asarray(columns, np.int64))
        return self.node("Gather", [x, index], [index.shape], x.dtype, axis=1)[0]

    def pick(self, x: Value, index: Value) -> Value:
        """Picks one column per row: x [N, D] and an index [N, 1] give [N, 1]."""
        return self.node("GatherElements", [x, index], [index.shape], x.dtype, axis=1)[0]

    def concat(self, values: Sequence[Value]) -> Value:
        """Joins columns."""
        width = sum(value.shape[0] for value in values)
        return self.node("Concat", values, [(width,)], values[0].dtype, axis=1)[0]

    def split(self, x: Value, sizes: Sequence[int]) -> list[Value]:
        """Cuts a row into groups of columns."""
        shapes = [(size,) for size in sizes]
        return self.node("Split", [x, self._axes(sizes)], shapes, x.dtype, axis=1)

    def columns(self, x: Value) -> list[Value]:
        """Cuts a row into its columns, each [N, 1]."""
        return self.split(x, [1] * x.shape[0])

    def column(self, x: Value) -> Value:
        """Returns a column [N, 1] as it is, which multiplies rows."""
        return x

    def slice(self, x: Value, start: int, stop: int) -> Value:
        """Returns columns start .. stop - 1."""
        ends = [self._axes([start]), self._axes([stop]), self._axes([1])]
        return self.node("Slice", [x, *ends], [(stop - start,)], x.dtype)[0]

    def flatten(self, x: Value) -> Value:
        """Turns a single column [N, 1] into [N]."""
        return self.node("Squeeze", [x, self._axes([1])], [()], x.dtype)[0]

    def reshape(self, x: Value, *shape: int) -> Value:
        """Arranges each row as a tensor of this shape."""
        return self.node("Reshape", [x, self._axes([-1, *shape])], [shape], x.dtype)[0]

    def channels_last(self, x: Value) -> Value:
        """Moves the first axis of each row's tensor to the end: [N, C, H, W] to [N, H, W, C]."""
        channels, height, width = x.shape
        shape = (height, width, channels)
        return self.node("Transpose", [x], [shape], x.dtype, perm=[0, 2, 3, 1])[0]

    # Serialization

    def to_bytes(self) -> bytes:
        """Returns the network as ONNX: only nodes and constants that an output needs."""
        nodes = self._needed()
        used = {name for node in nodes for name in node.input}
        graph = helper.make_graph(
            nodes,
            self.name,
            [_info(value) for value in self._inputs],
            [_info(value) for value in self._outputs],
            [
                numpy_helper.from_array(array, value.name)
                for value, array in self._constants.values()
                if value.name in used
            ],
        )
        opset = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph, opset_imports=opset, ir_version=IR_VERSION)
        model.producer_name = "purelight"
        return model.SerializeToString(deterministic=True)

    def _needed(self) -> list[Any]:
        """Returns the nodes that an output depends on, in order."""
        wanted = {value.name for value in self._outputs}
        kept = []
        for proto, _ in reversed(self._nodes.values()):
            if wanted.intersection(proto.output):
                wanted.update(proto.input)
                kept.append(proto)
        return kept[::-1]


def _info(value: Value) -> Any:
    return helper.make_tensor_value_info(value.name, TensorProto.FLOAT, [ROWS, *value.shape])
