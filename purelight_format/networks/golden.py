"""Golden vectors: inputs, float64 outputs, and how far a float32 host may be from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks import reference
from purelight_format.networks.vectors import Vectors, answers

COUNT = 64
VALUES = 1 << 14  # of outputs, which maps of radiance have in fewer vectors
FLOOR = 1e-4
FACTOR = 8.0
TRIALS = 4
WEIGHTS = {"Gemm": (1, 2), "Gather": (0,)}

Arrays = dict[str, np.ndarray]
Evaluation = Callable[[Arrays, Any], Arrays]  # Inputs and the type to calculate in -> outputs.
Shaking = Callable[[np.random.Generator], Evaluation]  # The same with weights rounded anew.


@dataclass(frozen=True)
class Judgement:
    """What is demanded of a float32 host.

    Arguments:
        outputs: float64 [N, ...] by name.
        tolerances: shaped as the outputs.
        fit: [N] whether rounding changes the answer by less than a tenth; the others say nothing
            about a host.
    """

    outputs: Arrays
    tolerances: Arrays
    fit: np.ndarray


def count(network: str) -> int:
    """How many vectors a network gets."""
    return min(COUNT, VALUES // answers(network))


def golden_vectors(
    network: str, model: bytes, candidates: Mapping[str, np.ndarray], units: Mapping[str, float]
) -> Vectors:
    """Chooses vectors of a network and their tolerances.

    Arguments:
        candidates: Inputs [M, ...], the most wanted first.
        units: The size of each output that counts as small; zero for purely relative.

    Raises:
        PureLightError: If too few candidates are well conditioned.
    """
    inputs = {name: np.asarray(array, np.float32) for name, array in candidates.items()}
    judged = judge(
        inputs, _evaluation(model), units, shaking=lambda rng: _evaluation(shaken(model, rng))
    )
    chosen = np.flatnonzero(judged.fit)[: count(network)]
    if len(chosen) < count(network):
        raise PureLightError(f"{network}: only {len(chosen)} golden vectors are well conditioned")
    groups = (inputs, judged.outputs, judged.tolerances)
    return Vectors(network, *({k: array[chosen] for k, array in group.items()} for group in groups))


def judge(
    inputs: Arrays,
    evaluate: Evaluation,
    units: Mapping[str, float],
    *,
    shaking: Shaking | None = None,
    floor: float = FLOOR,
) -> Judgement:
    r"""Evaluates vectors and finds their tolerances.

    A tolerance is :math:`\text{floor}\,(|y| + \text{unit}) + 8 \max |y - y'|`, where y is
    evaluated in float64 and y' in float32, or with inputs and weights rounded differently.

    Arguments:
        inputs: float32 [N, ...] by name.
        evaluate: What is tested.
        units: The size of each output that counts as small; zero for purely relative.
        shaking: What is tested, with its weights rounded differently; it has none if left out.
    """
    rng = np.random.default_rng(0)
    exact = evaluate(inputs, np.float64)
    trials = [evaluate(inputs, np.float32)]
    for _ in range(TRIALS):
        moved = {name: _neighbour(array, rng) for name, array in inputs.items()}
        again = shaking(rng) if shaking else evaluate
        trials.append(again(moved, np.float64))
    tolerances, fit = {}, np.ones(len(next(iter(inputs.values()))), bool)
    for name, y in exact.items():
        spread = np.max([np.abs(trial[name] - y) for trial in trials], axis=0)
        tolerances[name] = floor * (np.abs(y) + units[name]) + FACTOR * spread
        fit &= _rows_within(tolerances[name], 0.1 * (_row_size(y) + units[name]))
    return Judgement(exact, tolerances, fit)


def _evaluation(model: bytes) -> Evaluation:
    return lambda inputs, dtype: reference.evaluate(model, inputs, dtype)


def shaken(model: bytes, rng: np.random.Generator) -> bytes:
    """The network with every learned weight moved to a neighbouring float32."""
    import onnx
    from onnx import numpy_helper

    proto = onnx.load_from_string(model)
    learned = {node.input[k] for node in proto.graph.node for k in WEIGHTS.get(node.op_type, ())}
    for tensor in proto.graph.initializer:
        if tensor.name in learned and tensor.data_type == onnx.TensorProto.FLOAT:
            array = _neighbour(numpy_helper.to_array(tensor), rng)
            tensor.CopyFrom(numpy_helper.from_array(array, tensor.name))
    return proto.SerializeToString()


def _neighbour(array: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One unit in the last place up or down; zero stays."""
    toward = np.where(rng.random(array.shape) < 0.5, np.float32(-np.inf), np.float32(np.inf))
    return np.where(array == 0, array, np.nextafter(array, toward, dtype=np.float32))


def _rows_within(value: np.ndarray, bound: np.ndarray) -> np.ndarray:
    rows = value.reshape(len(value), -1)
    return np.isfinite(rows).all(1) & (rows.max(1) <= bound)


def _row_size(value: np.ndarray) -> np.ndarray:
    return np.abs(value).reshape(len(value), -1).max(1)
