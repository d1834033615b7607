"""Networks on NumPy arrays, and whether they meet the golden vectors of their bundle."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks.vectors import SIGNATURES, Vectors, compare
from purelight_mitsuba.translate.half_precision import half_bound
from purelight_mitsuba.translate.network import FusedNetwork

Arrays = dict[str, np.ndarray]
POINTS = {2: "Point2f", 3: "Point3f"}


HALF = (
    "dense layers have half precision in this variant; networks are held to its bound, which is "
    "wider than that of their golden vectors (runtimes/mitsuba/README.md, On a GPU)"
)


class ReducedPrecisionWarning(UserWarning):
    """Networks are evaluated in half precision."""


def require_golden(
    network: FusedNetwork, vectors: Vectors, model: bytes, radiance_scale: float
) -> None:
    """Compares a translated network with its golden vectors; call this outside of loops.

    In half precision, which is a warning, the bound is that of `half_bound`, and a vector for which
    it is too wide to say anything is not judged.

    Raises:
        PureLightError: If a vector is not met.
    """
    judged = np.ones(len(vectors), bool)
    if network.half:
        bound, judged = half_bound(model, vectors, radiance_scale)
        vectors = replace(vectors, tolerances=bound)
        warnings.warn(HALF, ReducedPrecisionWarning, stacklevel=2)
        if 2 * judged.sum() < len(vectors):
            text = f"{network.name}: half precision is too coarse for most golden vectors"
            warnings.warn(f"{text}; compare with llvm_ad_rgb", ReducedPrecisionWarning, 2)
    passed = compare(vectors, evaluate(network, vectors.network, vectors.inputs)).passed
    failed = int((judged & ~passed).sum())
    if failed:
        raise PureLightError(
            f"{network.name}: {failed} of {len(vectors)} golden vectors are not met; "
            "this host evaluates the network wrongly"
        )


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
