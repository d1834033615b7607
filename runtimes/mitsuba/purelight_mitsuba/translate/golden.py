"""Networks on NumPy arrays, and whether they meet the golden vectors of their bundle."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks.vectors import SIGNATURES, Vectors
from purelight_mitsuba.translate.network import FusedNetwork
from purelight_onnx.luminaire import check

Arrays = dict[str, np.ndarray]
POINTS = {2: "Point2f", 3: "Point3f"}


class ReducedPrecisionWarning(UserWarning):
    """A network of half precision does not meet its golden vectors."""


def require_golden(network: FusedNetwork, vectors: Vectors) -> None:
    """Compares a translated network with its golden vectors; call this outside of loops.

    On CUDA, where layers have half precision, what is not met is a warning.

    Raises:
        PureLightError: If a vector is not met.
    """
    try:
        check(partial(evaluate, network, vectors.network), vectors)
    except PureLightError as error:
        if dr.backend_v(mi.Float) != dr.JitBackend.CUDA:
            raise PureLightError(f"{network.name}: {error}") from error
        text = f"{network.name}: {error}; the layers have half precision on CUDA"
        warnings.warn(text, ReducedPrecisionWarning, stacklevel=2)


def evaluate(network: FusedNetwork, name: str, inputs: Arrays) -> Arrays:
    """Evaluates a network on at least one row.

    Arguments:
        name: a key of `SIGNATURES`.
        inputs: [N, ...] by name.

    Returns:
        The outputs by name, [N, ...] float32.
    """
    signature, rows = SIGNATURES[name], len(next(iter(inputs.values())))
    values = network(*(lanes(inputs[key]) for key in signature.inputs))
    return {
        key: rows_of(value, rows, shape)
        for (key, shape), value in zip(signature.outputs.items(), values, strict=True)
    }


def lanes(array: np.ndarray) -> Any:
    """[N] or [N, D] as one lane per row."""
    data = np.ascontiguousarray(array.T, np.float32)
    return mi.Float(data) if array.ndim == 1 else getattr(mi, POINTS[array.shape[1]])(data)


def rows_of(value: Any, rows: int, shape: tuple[int, ...]) -> np.ndarray:
    """[N, *shape] from lanes, or from an object array of them; constants have one lane only."""
    single = isinstance(value, mi.Float)
    columns = value.reshape(-1) if isinstance(value, np.ndarray) else [value] if single else value
    dr.eval(*columns)
    filled = [np.broadcast_to(column.numpy(), rows) for column in columns]
    return np.stack(filled, 1).reshape(rows, *shape)
