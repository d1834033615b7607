"""Golden vectors: inputs, float64 outputs, and how far a float32 host may be from them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import onnx
from onnx import numpy_helper

from purelight_format import reference
from purelight_format.errors import PureLightError
from purelight_format.vectors import Vectors

COUNT = 64
FLOOR = 1e-4
FACTOR = 8.0
TRIALS = 4
WEIGHTS = {"Gemm": (1, 2), "Gather": (0,)}

Arrays = dict[str, np.ndarray]


def golden_vectors(
    network: str, model: bytes, candidates: Mapping[str, np.ndarray], units: Mapping[str, float]
) -> Vectors:
    r"""Chooses vectors and their tolerances.

    A tolerance is :math:`10^{-4}(|y| + \text{unit}) + 8 \max |y - y'|`, where y is evaluated in
    float64 and y' with weights and inputs rounded differently, or in float32. Candidates whose
    answer that rounding changes by a tenth say nothing about a host and are left out.

    Arguments:
        candidates: Inputs [M, ...], the most wanted first.
        units: The size of each output that counts as small; zero for purely relative.

    Raises:
        PureLightError: If fewer than 64 candidates are well conditioned.
    """
    inputs = {name: np.asarray(array, np.float32) for name, array in candidates.items()}
    exact = reference.evaluate(model, inputs)
    spread = _spread(model, inputs, exact)
    slack = {name: FLOOR * (np.abs(y) + units[name]) for name, y in exact.items()}
    tolerances = {name: slack[name] + FACTOR * spread[name] for name in exact}
    fit = np.ones(len(next(iter(inputs.values()))), bool)
    for name, y in exact.items():
        fit &= _rows_within(tolerances[name], 0.1 * (_row_size(y) + units[name]))
    chosen = np.flatnonzero(fit)[:COUNT]
    if len(chosen) < COUNT:
        raise PureLightError(f"{network}: only {len(chosen)} golden vectors are well conditioned")
    inputs, exact, tolerances = (
        {name: array[chosen] for name, array in arrays.items()}
        for arrays in (inputs, exact, tolerances)
    )
    return Vectors(network, inputs, exact, tolerances)


def _spread(model: bytes, inputs: Arrays, exact: Arrays) -> Arrays:
    """Largest change of each output under different rounding."""
    rng = np.random.default_rng(0)
    trials = [reference.evaluate(model, inputs, np.float32)]
    for _ in range(TRIALS):
        shaken = {name: _neighbour(array, rng) for name, array in inputs.items()}
        trials.append(reference.evaluate(_shaken(model, rng), shaken))
    return {
        name: np.max([np.abs(trial[name] - y) for trial in trials], axis=0)
        for name, y in exact.items()
    }


def _shaken(model: bytes, rng: np.random.Generator) -> bytes:
    """The network with every learned weight moved to a neighbouring float32."""
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
