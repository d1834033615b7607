"""An ONNX network as Dr.Jit operations, fit for the inside of symbolic loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import onnx
from drjit import nn
from onnx import numpy_helper

from purelight_format.errors import PureLightError
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.translate.operators import OPERATORS, Tensor, from_start, literal_type, row

LITERAL_INPUTS = 4  # Layers of so few inputs (grid scales, one-blobs) are faster written out.

PACKETS = {"f4": "f", "i4": "i", "i8": "i64", "b1": "b"}  # Dr.Jit's letters of NumPy's types.

WIDE, BLOCK = 64, 32  # Outputs; on a CPU more of them leave the fastest cache.

Vector = Any  # nn.CoopVec, which Dr.Jit does not export as a type.
Value = Tensor | Vector


@dataclass(frozen=True)
class Step:
    """One node: what to call with the values of its operands, and the names of its outputs.

    Arguments:
        operands: Names of tensors, less those that are part of the function.
    """

    function: Callable[..., Any]
    operands: tuple[str, ...]
    outputs: tuple[str, ...]


class FusedNetwork:
    """Evaluates a network of the profile, one query per lane, inside the kernel being traced.

    Weights are on the device before anything is traced. Dense layers are cooperative vectors, and
    stay so from layer to layer; everything else is scalar arithmetic.

    Arguments:
        model: The bytes of an ONNX network whose tensors all have the row as first axis.
        name: What to call the network in errors.
        half: Whether dense layers have half precision; by default on CUDA, which has no other.

    Raises:
        PureLightError: If the bytes are no ONNX, or an operator is not of the profile.
    """

    def __init__(self, model: bytes, *, name: str = "network", half: bool | None = None) -> None:
        self.name = name
        self.half = dr.backend_v(mi.Float) == dr.JitBackend.CUDA if half is None else half
        graph = _parse(model, name).graph
        self._constants = {t.name: numpy_helper.to_array(t) for t in graph.initializer}
        self._inputs = [value.name for value in graph.input]
        self._outputs = [value.name for value in graph.output]
        self._steps = [self._step(node) for node in graph.node]

    def __call__(self, *inputs: Any) -> list[np.ndarray]:
        """Traces the network.

        Arguments:
            inputs: One Dr.Jit array per input of the network: [N, 3] is a `mi.Point3f`.

        Returns:
            One object array of `mi.Float` per output: shape [D] for [N, D], [] for [N].
        """
        parts = (row([value[i] for i in range(len(value))]) for value in inputs)
        values: dict[str, Value] = dict(zip(self._inputs, parts, strict=True))
        for step in self._steps:
            self._run(step, values)
        return [columns(values[name]) for name in self._outputs]

    def _run(self, step: Step, values: dict[str, Value]) -> None:
        operands = [values.get(name, self._constants.get(name)) for name in step.operands]
        result = step.function(*operands)
        results = result if isinstance(result, list) else [result]
        values.update(zip(step.outputs, results, strict=True))

    def _step(self, node: onnx.NodeProto) -> Step:
        attributes = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        constants = [self._constants.get(name) for name in node.input]
        operands = tuple(node.input)
        function: Callable[..., Any]
        if node.op_type in ("Gemm", "MatMul"):
            weight, bias = _affine(node.op_type, constants, attributes, self.name)
            few = weight.shape[1] <= LITERAL_INPUTS
            function = Literal(weight, bias) if few else Dense(weight, bias, self.half)
            operands = operands[:1]
        elif node.op_type == "Gather" and constants[0] is not None:
            function, operands = Table(constants[0], **attributes), operands[1:]
        elif node.op_type in OPERATORS:
            function = _scalar(node.op_type, attributes)
        else:
            raise PureLightError(f"{self.name}: operator {node.op_type} is not of the profile")
        return Step(function, operands, tuple(node.output))


def _parse(model: bytes, name: str) -> onnx.ModelProto:
    try:
        return onnx.load_from_string(model)
    except Exception as error:  # protobuf's DecodeError has no public home.
        raise PureLightError(f"{name}: not an ONNX model ({error})") from error


def columns(value: Value) -> Tensor:
    """Returns a tensor as scalars, whether it is one already or a cooperative vector."""
    return value if isinstance(value, np.ndarray) else row([mi.Float(x) for x in value])


def _scalar(op: str, attributes: dict[str, Any]) -> Callable[..., Any]:
    """An operator of the table; Relu and Add leave cooperative vectors as they are."""
    operator = partial(OPERATORS[op], **attributes)

    def function(*values: Value) -> Any:
        if all(isinstance(value, nn.CoopVec) for value in values):
            if op == "Relu":
                return dr.maximum(values[0], 0)
            if op == "Add" and len(values[0]) == len(values[1]):
                return values[0] + values[1]
        return operator(*(None if value is None else columns(value) for value in values))

    return function


class Dense:
    """A layer y = W x + b by a cooperative vector.

    Arguments:
        weight: [out, in].
        bias: [out].
        half: Whether in half precision.
    """

    def __init__(self, weight: np.ndarray, bias: np.ndarray, half: bool) -> None:
        tensor = mi.TensorXf16 if half else mi.TensorXf
        self._scalar = mi.Float16 if half else mi.Float
        size = len(weight) if half or len(weight) <= WIDE else BLOCK
        starts = range(0, len(weight), size)
        self._blocks = [
            nn.pack([tensor(weight[k : k + size]), tensor(bias[k : k + size])]) for k in starts
        ]
        dr.eval([view.buffer for block in self._blocks for view in block])

    def __call__(self, x: Value) -> Value:
        if isinstance(x, np.ndarray):
            x = nn.CoopVec(*(self._scalar(element) for element in x))
        outputs = [nn.matvec(weight, x, bias) for weight, bias in self._blocks]
        if len(outputs) == 1:
            return outputs[0]
        # As scalars, so that blocks of which no output is used are never computed.
        return row([mi.Float(y) for block in outputs for y in block])


class Literal:
    """A layer y = W x + b of few inputs, written out without its zeros, in single precision."""

    def __init__(self, weight: np.ndarray, bias: np.ndarray) -> None:
        self._rows = list(zip(weight.tolist(), bias.tolist(), strict=True))

    def __call__(self, x: Value) -> Tensor:
        scalars = columns(x)
        return row([self._output(weights, bias, scalars) for weights, bias in self._rows])

    @staticmethod
    def _output(weights: Sequence[float], bias: float, x: Tensor) -> Any:
        total = mi.Float(bias)
        for weight, column in zip(weights, x, strict=True):
            if weight != 0:
                total = dr.fma(column, weight, total)
        return total


def _affine(
    op: str, constants: Sequence[np.ndarray | None], attributes: dict[str, Any], name: str
) -> tuple[np.ndarray, np.ndarray]:
    matrix = constants[1]
    if matrix is None or matrix.ndim != 2 or attributes.get("transA"):
        raise PureLightError(f"{name}: {op} needs a constant matrix on its right")
    weight = matrix if attributes.get("transB") else matrix.T
    weight = np.ascontiguousarray(weight * np.float32(attributes.get("alpha", 1)))
    offset = constants[2] if len(constants) > 2 and constants[2] is not None else np.zeros(1)
    beta = np.float32(attributes.get("beta", 1))
    bias = np.broadcast_to(offset.reshape(-1) * beta, len(weight)).astype(np.float32)
    return weight, bias


class Table:
    """Looks up a constant [T, *shape] by an index [N] or [N, D]; an index outside is clamped."""

    def __init__(self, table: np.ndarray, *, axis: int = 0) -> None:
        if axis != 0:
            raise PureLightError("a table must be looked up by its rows")
        kind = literal_type(table.dtype)
        self._dtype = table.dtype.str[1:]
        self._rows, self._shape = len(table), table.shape[1:]
        self._size = int(np.prod(self._shape))
        self._entries = device_array(kind, table)

    def __call__(self, index: Value) -> Tensor:
        parts = [self._entry(element) for element in columns(index).reshape(-1)]
        flat = row([value for part in parts for value in part])
        return flat.reshape((*columns(index).shape, *self._shape))

    def _entry(self, index: Any) -> list[Any]:
        """The values of one row of the table, gathered together."""
        safe = dr.minimum(mi.UInt(from_start(index, self._rows)), self._rows - 1)
        if self._size == 1:
            return [dr.gather(type(self._entries), self._entries, safe)]
        packet = getattr(mi, f"ArrayX{PACKETS[self._dtype]}")
        values = dr.gather(packet, self._entries, safe, shape=(self._size, dr.width(safe)))
        return [values[k] for k in range(self._size)]
