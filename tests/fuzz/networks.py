"""Networks under attack: damage to their graphs, and what an accepted one must keep."""

from __future__ import annotations

import contextlib
import functools
import re
import time
from collections.abc import Callable
from random import Random
from typing import Any
from unittest import mock

import numpy as np
import onnx
import onnxruntime
from google.protobuf.descriptor import FieldDescriptor
from onnxruntime.capi import onnxruntime_pybind11_state as state

from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS
from purelight_format.networks import reference
from purelight_format.networks.operators import OPERATORS, TYPES
from purelight_format.networks.profile import NetworkCost
from purelight_format.networks.vectors import SIGNATURES
from purelight_onnx.session import Session
from tests.fuzz.mutation import mutate

EXTREMES = (0.3, 0.0, -1.0, 1e30, -3e38, np.inf, np.nan)
ROWS = len(EXTREMES)
GOLDEN = 64  # Rows, as many as a bundle has.
VAST = 2.0**24  # From here on a float32 is more than one from the next.
LONGER, OPENING = 5.0, 0.5  # Times the stated work, and seconds.
INTEGERS = (0, 1, -1, 3, 2**31 - 1, -(2**31), 2**62, -(2**63))


def _cast(x: Any, to: int, dtype: Any) -> Any:
    """A conversion, but to 7 of a float beyond the integer's range."""
    kind = np.dtype(TYPES[to])
    if x.dtype.kind == "f" and kind.kind == "i":
        x = np.where(np.abs(x) < np.iinfo(kind).max, x, 7)
    return CAST(x, to, dtype=dtype)


def _unless_vast(function: Callable[..., Any]) -> Callable[..., Any]:
    """A sine, but no number of what is vast."""
    return lambda x: np.where(np.abs(x) < VAST, function(x), np.nan)


def _remainder(a: Any, b: Any, fmod: int = 0) -> Any:
    if not fmod:
        return np.mod(a, b)
    return np.where(np.abs(a / b) < VAST, np.fmod(a, b), np.nan)


CAST = reference.OPERATORS["Cast"]
# Operators that give something else where N13 leaves the answer to the host
UNSETTLED = {
    "Cast": _cast, "Cos": _unless_vast(np.cos), "Mod": _remainder, "Sin": _unless_vast(np.sin),
}  # fmt: skip


def damaged(model: bytes, rng: Random) -> bytes:
    """A model with one or two changes of its graph."""
    proto = onnx.ModelProto()
    proto.CopyFrom(_parsed(model))
    for _ in range(rng.randrange(1, 3)):
        _damage(proto.graph, rng)
    return proto.SerializeToString()


@functools.cache
def _parsed(model: bytes) -> onnx.ModelProto:
    return onnx.load_from_string(model)


def require_stated_cost(data: bytes, network: str, cost: NetworkCost) -> None:
    """Every intermediate has exactly the elements per row that the walk foretold."""
    assert cost.floats_per_sample <= LIMITS.sample_floats_sum
    try:
        results = reference.evaluate(with_all_values(data), _feed(network), np.float32)
    except PureLightError:
        return  # A computed index beyond its table stops the evaluation.
    measured = sum(value.size for value in results.values())
    assert measured == ROWS * cost.floats_per_sample
    for name, shape in SIGNATURES[network].outputs.items():
        assert results[name].shape == (ROWS, *shape)


def require_a_runtime(data: bytes, network: str) -> None:
    """ONNX Runtime takes what we accept, survives extreme inputs, and gives the promised shapes."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    outputs = SIGNATURES[network].outputs
    for model in (data, with_all_values(data)):
        session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        try:
            results = session.run(list(outputs), _feed(network))
            session.run(None, _feed(network))
        except (state.InvalidArgument, state.Fail) as error:
            _require_an_index(str(error))
            continue
        for result, shape in zip(results, outputs.values(), strict=True):
            assert result.shape == (ROWS, *shape)


def require_stated_time(data: bytes, network: str, cost: NetworkCost) -> None:
    """Both evaluators take at most LONGER times the stated work, beside what opening takes."""
    model, stated = with_all_values(data), cost.nanoseconds * 1e-9
    rows = {k: np.resize(v, (GOLDEN, *v.shape[1:])) for k, v in _feed(network).items()}
    session = Session(model, floats=cost.floats_per_sample)

    def run(evaluate: Callable[[], Any]) -> float:
        start = time.process_time()
        with contextlib.suppress(PureLightError):  # A computed index beyond its table.
            evaluate()
        return time.process_time() - start

    evaluators: dict[str, Callable[[], Any]] = {
        "NumPy": lambda: reference.evaluate(model, rows, np.float32),
        "ONNX Runtime": lambda: session(rows),
    }
    for name, evaluate in evaluators.items():
        taken = min(run(evaluate) for _ in range(3))
        assert taken < OPENING + LONGER * GOLDEN * stated, f"{name}: {taken} s, stated {stated}"


def require_compiled(data: bytes, network: str) -> bool:
    """Dr.Jit compiles and evaluates what is not refused, in about the foretold time."""
    from purelight_mitsuba.platform import use
    from purelight_mitsuba.translate import compile_cost, golden
    from purelight_mitsuba.translate.network import FusedNetwork

    use()
    try:
        compile_cost.require_compilable(data, network, "lamp")
        fused = FusedNetwork(data)
        start = time.process_time()
        results = golden.evaluate(fused, network, _feed(network))
    except PureLightError:
        return False
    taken, foretold = time.process_time() - start, sum(compile_cost.seconds(data, network))
    assert taken < OPENING + LONGER * foretold, f"{taken} s, foretold {foretold}"
    _require_same(data, network, results)
    return True


def _require_same(data: bytes, network: str, results: dict[str, np.ndarray]) -> None:
    """Shapes are right; where rounding changes nothing, values are those of the evaluator.

    Where a value is endless its sign may be that of a zero, which Dr.Jit does not keep.
    """
    for name, shape in SIGNATURES[network].outputs.items():
        assert results[name].shape == (ROWS, *shape)
    feed = {name: array[:1] for name, array in _feed(network).items()}
    try:
        model = with_all_values(data)
        values = reference.evaluate(model, feed, np.float32)
        with mock.patch.dict(reference.OPERATORS, UNSETTLED):
            exact = reference.evaluate(model, feed, np.float64)
    except PureLightError:
        return  # A computed index beyond its table, which Dr.Jit clamps.
    if all(np.allclose(y, exact[name], 1e-5, 1e-5) for name, y in values.items()) and all(
        np.isfinite(values[name]).all() for name in results
    ):
        for name, result in results.items():
            np.testing.assert_allclose(result[:1], values[name], rtol=1e-3, atol=1e-3)


def _require_an_index(message: str) -> None:
    """The one fault of a run that the profile leaves to the runtime."""
    assert re.search("out of (data )?(range|bounds)", message, re.I), message


def _feed(network: str) -> dict[str, np.ndarray]:
    """Each row holds one extreme number."""
    column = np.array(EXTREMES, np.float32)
    return {
        name: np.repeat(column, np.prod(shape, dtype=int)).reshape(ROWS, *shape)
        for name, shape in SIGNATURES[network].inputs.items()
    }


def with_all_values(data: bytes) -> bytes:
    """The model with every intermediate among its outputs, so that no node is left out."""
    proto = onnx.load_from_string(data)
    stated = {value.name for value in proto.graph.output}
    names = [name for node in proto.graph.node for name in node.output if name not in stated]
    proto.graph.output.extend(onnx.ValueInfoProto(name=name) for name in names)
    return proto.SerializeToString()


def _damage(graph: Any, rng: Random) -> None:
    """Changes one thing of a graph that still parses."""
    names = [n for node in graph.node for n in (*node.input, *node.output)] + ["", "nothing"]
    node = graph.node[rng.randrange(len(graph.node))]
    tensor = graph.initializer[rng.randrange(len(graph.initializer))]
    match rng.randrange(9):
        case 0:
            node.op_type = rng.choice([*OPERATORS, "Loop", "Expand"])
        case 1 if node.input:
            node.input[rng.randrange(len(node.input))] = rng.choice(names)
        case 2:
            node.input.append(rng.choice(names))
        case 3 if tensor.dims:
            tensor.dims[rng.randrange(len(tensor.dims))] = rng.choice([0, 1, 3, 8, 2**40])
        case 4:
            tensor.raw_data = mutate(tensor.raw_data, rng)
        case 5 if node.attribute:
            node.attribute[0].i = rng.choice([-2, -1, 0, 1, 2, 2**62])
        case 6:
            graph.node.insert(rng.randrange(len(graph.node)), _new_node(graph, rng, names))
        case 7:
            _add_integers(graph, rng, rng.choice([value.name for value in graph.input]))
        case _:
            _change_some_field(node if rng.random() < 0.5 else tensor, rng)


def _new_node(graph: Any, rng: Random, names: list[str]) -> Any:
    """An operator of the profile on values of the graph, which may well fit."""
    op = rng.choice(list(OPERATORS))
    inputs = [rng.choice(names) for _ in range(OPERATORS[op].least)]
    node = onnx.helper.make_node(op, inputs, [f"new{len(graph.node)}"])
    for name in OPERATORS[op].attributes:
        node.attribute.add(name=name, type=onnx.AttributeProto.INT, i=rng.randrange(-1, 3))
    return node


def _add_integers(graph: Any, rng: Random, source: str) -> None:
    """Arithmetic of integers, or a lookup by them, on what was a number of the network."""
    node, kind = onnx.helper.make_node, rng.choice((6, 7))
    dtype = np.int32 if kind == 6 else np.int64
    values = np.array(rng.choices(INTEGERS, k=rng.choice((1, 3)))).astype(dtype)
    number = len(graph.node)
    made = [node("Cast", [source], [f"i{number}"], to=kind)]
    pair = [f"i{number}", f"c{number}"]
    match rng.randrange(4):
        case 0:
            made += [node("Mul", pair, [f"j{number}"]), node("Div", pair, [f"k{number}"])]
        case 1:
            made.append(node("Gather", pair[::-1], [f"j{number}"]))
        case 2:
            made.append(node("GatherElements", [source, pair[0]], [f"j{number}"], axis=1))
        case _:
            made.append(node(rng.choice(("Div", "Mod")), rng.sample(pair, 2), [f"j{number}"]))
    graph.initializer.append(onnx.numpy_helper.from_array(values, f"c{number}"))
    for k, item in enumerate(made):
        graph.node.insert(k, item)


def _change_some_field(message: Any, rng: Random) -> None:
    """Sets a scalar field of a protobuf message to a value that it seldom has."""
    fields = [f for f in message.DESCRIPTOR.fields if f.cpp_type != FieldDescriptor.CPPTYPE_MESSAGE]
    field = fields[rng.randrange(len(fields))]
    kinds = {
        FieldDescriptor.CPPTYPE_STRING: "text" if field.type == field.TYPE_STRING else b"bytes",
        FieldDescriptor.CPPTYPE_FLOAT: 1.5,
        FieldDescriptor.CPPTYPE_DOUBLE: 1.5,
    }
    value = kinds.get(field.cpp_type, 1)
    if field.is_repeated:
        getattr(message, field.name).append(value)
    else:
        setattr(message, field.name, value)
