"""One name each for the functions of NumPy, torch and graphs of operators that formulas need.

A formula asks `namespace` for those of its argument. Vectors are [..., D] and their coordinates
[...] in NumPy and torch; in a graph they are [N, D] and [N, 1].
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import Any, Protocol, TypeVar

import numpy as np


class Array(Protocol):
    """An array, a tensor, or a value of a graph."""

    def __sub__(self, other: Any, /) -> Any: ...
    def __mul__(self, other: Any, /) -> Any: ...
    def __rmul__(self, other: Any, /) -> Any: ...


A = TypeVar("A", bound=Array)


class Namespace(Protocol):
    """Functions that are not operators of Python.

    Attributes:
        columns, concat: vectors to their coordinates, and back.
        column: a coordinate as a factor of vectors.
        sum: of each vector's coordinates.
        vector: a constant vector in the type of an array, and where that is.
        least: the shortest length in the type of an array that others can be divided by.
    """

    where: Callable[..., Any]
    sqrt: Callable[[Any], Any]
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    asin: Callable[[Any], Any]
    atan: Callable[[Any], Any]
    log: Callable[[Any], Any]
    sign: Callable[[Any], Any]
    relu: Callable[[Any], Any]
    maximum: Callable[[Any, float], Any]
    clip: Callable[[Any, float, float], Any]
    columns: Callable[[Any], Sequence[Any]]
    concat: Callable[[Sequence[Any]], Any]
    column: Callable[[Any], Any]
    sum: Callable[[Any], Any]
    vector: Callable[[Sequence[float], Any], Any]
    least: Callable[[Any], float]


def namespace(array: Any) -> Namespace:
    """Returns the functions for arrays of this kind; a graph's value brings its graph."""
    if isinstance(array, (np.ndarray, np.generic)):
        return NUMPY
    if type(array).__module__.partition(".")[0] == "torch":
        return _torch()
    graph: Namespace = array.graph
    return graph


NUMPY: Namespace = SimpleNamespace(
    where=np.where, sqrt=np.sqrt, sin=np.sin, cos=np.cos, asin=np.arcsin, atan=np.arctan,
    log=np.log, sign=np.sign, maximum=np.maximum, clip=np.clip,
    relu=lambda x: np.maximum(x, 0),
    columns=lambda x: np.moveaxis(x, -1, 0),
    concat=lambda parts: np.stack(parts, -1),
    column=lambda x: x[..., None],
    sum=lambda x: x.sum(-1),
    vector=lambda values, like: np.array(values, like.dtype),
    least=lambda like: float(np.finfo(like.dtype).tiny),
)  # fmt: skip


@cache
def _torch() -> Namespace:
    torch: Any = sys.modules["torch"]  # Who has a tensor has loaded it.

    @lru_cache(64)  # A copy to a GPU would wait for it each time.
    def vector(values: tuple[float, ...], dtype: Any, device: Any) -> Any:
        return torch.tensor(values, dtype=dtype, device=device)

    found: Namespace = SimpleNamespace(
        where=torch.where, sqrt=torch.sqrt, sin=torch.sin, cos=torch.cos, asin=torch.asin,
        atan=torch.atan, log=torch.log, sign=torch.sign, relu=torch.relu, clip=torch.clamp,
        maximum=lambda x, least: x.clamp(min=least),
        columns=lambda x: x.unbind(-1),
        concat=lambda parts: torch.stack(parts, -1),
        column=lambda x: x[..., None],
        sum=lambda x: x.sum(-1),
        vector=lambda values, like: vector(tuple(values), like.dtype, like.device),
        least=lambda like: torch.finfo(like.dtype).tiny,
    )  # fmt: skip
    return found
