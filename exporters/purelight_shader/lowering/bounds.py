"""Between which numbers every element of a value lies: which integers fit into 32 bits.

Bounds are float64 arrays of a value's own shape. They are safe, not tight; what may be infinite
is bounded by `MOST`, from which all arithmetic here stays finite.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from purelight_shader.form.elements import Kind

MOST = 1e39  # Beyond every float32.
INT_MOST, LONG_MOST = 2.0**31, 2.0**63
Transform = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Bounds:
    """Least and largest of each element."""

    low: np.ndarray
    high: np.ndarray

    def map(self, transform: Transform) -> Bounds:
        """The same of elements that are only moved."""
        return Bounds(transform(self.low), transform(self.high))

    def within(self, most: float) -> bool:
        """Whether every element is a signed integer below `most` in size."""
        return bool((self.low >= -most).all() and (self.high < most).all())


def of(array: np.ndarray) -> Bounds:
    """Those of a constant."""
    values = array.astype(np.float64)
    return Bounds(values, values)


def between(shape: tuple[int, ...], low: float, high: float) -> Bounds:
    """The same for all elements."""
    return Bounds(np.full(shape, low), np.full(shape, high))


def _bounded(low: np.ndarray, high: np.ndarray) -> Bounds:
    low, high = (np.nan_to_num(x, nan=n, posinf=MOST, neginf=-MOST) for x, n in
                 ((low, -MOST), (high, MOST)))  # fmt: skip
    return Bounds(np.clip(low, -MOST, MOST), np.clip(high, -MOST, MOST))


def rising(function: Transform) -> Callable[[Bounds], Bounds]:
    """Of a function that never falls."""

    def rule(x: Bounds) -> Bounds:
        with np.errstate(all="ignore"):
            return _bounded(function(x.low), function(x.high))

    return rule


def always(low: float, high: float) -> Callable[..., Bounds]:
    """Of a function whose results all lie between two numbers."""

    def rule(*operands: Bounds) -> Bounds:
        shape = np.broadcast_shapes(*(x.low.shape for x in operands))
        return between(shape, low, high)

    return rule


def corners(function: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[..., Bounds]:
    """Of a function of two operands that is monotonous in either."""

    def rule(a: Bounds, b: Bounds) -> Bounds:
        with np.errstate(all="ignore"):
            ends = [function(x, y) for x in (a.low, a.high) for y in (b.low, b.high)]
        return _bounded(np.minimum.reduce(ends), np.maximum.reduce(ends))

    return rule


def divided(a: Bounds, b: Bounds) -> Bounds:
    """Of a quotient: anything where the divisor may be zero."""
    found = corners(np.divide)(a, b)
    crossing = (b.low <= 0) & (b.high >= 0)
    low, high = np.where(crossing, -MOST, found.low), np.where(crossing, MOST, found.high)
    return Bounds(low, high)


def remainder(a: Bounds, b: Bounds) -> Bounds:
    """Of an integer remainder with a positive divisor, which is not negative."""
    shape = np.broadcast_shapes(a.low.shape, b.low.shape)
    small = np.where(a.low >= 0, a.high, MOST)
    return Bounds(np.zeros(shape), np.minimum(small, b.high - 1))


def rest(a: Bounds, b: Bounds) -> Bounds:
    """Of a remainder with the sign of the dividend."""
    size = np.minimum(magnitude(a).high, magnitude(b).high)
    return Bounds(np.where(a.low >= 0, 0, -size), np.where(a.high <= 0, 0, size))


def magnitude(x: Bounds) -> Bounds:
    """Of absolute values."""
    crossing = (x.low <= 0) & (x.high >= 0)
    ends = np.abs(x.low), np.abs(x.high)
    return Bounds(np.where(crossing, 0, np.minimum(*ends)), np.maximum(*ends))


def negated(x: Bounds) -> Bounds:
    return Bounds(-x.high, -x.low)


def either(condition: Bounds, a: Bounds, b: Bounds) -> Bounds:
    """Of a choice."""
    shape = np.broadcast_shapes(*(x.low.shape for x in (condition, a, b)))
    low, high = np.minimum(a.low, b.low), np.maximum(a.high, b.high)
    return Bounds(np.broadcast_to(low, shape), np.broadcast_to(high, shape))


def product(x: Bounds, weight: np.ndarray, bias: np.ndarray | float) -> Bounds:
    """Of `weight x + bias`, weight [out, in]."""
    up, down = np.maximum(weight, 0).astype(np.float64), np.minimum(weight, 0).astype(np.float64)
    return _bounded(
        up @ x.low + down @ x.high + bias, up @ x.high + down @ x.low + bias
    )  # fmt: skip


def joined(parts: Sequence[Bounds], axis: int) -> Bounds:
    """Of values side by side."""
    return Bounds(
        np.concatenate([part.low for part in parts], axis),
        np.concatenate([part.high for part in parts], axis),
    )


def kind_of(dtype: np.dtype, bounds: Bounds) -> Kind:
    """What holds elements of a type of ONNX: integers of 64 bits only where they may be large."""
    if dtype.kind == "f":
        return Kind.FLOAT
    if dtype.kind == "b":
        return Kind.BOOL
    return Kind.INT if dtype == np.int32 or bounds.within(INT_MOST) else Kind.LONG
