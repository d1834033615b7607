"""A density on the unit cube of any dimension, learned from points: a tree of halved boxes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
LEAST = 24  # points of a box that is halved
DEEPEST = 40
QUARTERS = 4


@dataclass(frozen=True)
class DensityTree:
    r"""Density that is even inside each leaf, P / V with the leaf's weight P and volume V.

    A box with enough points is halved along the axis on which they are spread least evenly, by the
    entropy of its quarters: halves alone would miss what lies in the middle.

    Arguments:
        axis: of each node's halving, -1 for leaves: [M].
        middle: where it is halved: [M].
        child: the lower half, before the upper one: [M].
        low, high: corners of each node's box: [M, D].
        density: of each leaf, over even: [M].
    """

    axis: NDArray[np.int64]
    middle: Float
    child: NDArray[np.int64]
    low: Float
    high: Float
    density: Float

    @staticmethod
    def of(points: Float, weight: Float) -> DensityTree:
        """From points [N, D] in the cube and weights [N], not all zero."""
        growing = _Growing(points, weight)
        while growing.halve():
            pass
        return growing.tree()

    def leaves(self, points: Float) -> NDArray[np.int64]:
        """The leaf that holds each point: [N, D] -> [N]."""
        node = np.zeros(len(points), np.int64)
        going = np.arange(len(points))
        while len(going):
            at = node[going]
            going, at = going[self.axis[at] >= 0], at[self.axis[at] >= 0]
            upper = points[going, self.axis[at]] >= self.middle[at]
            node[going] = self.child[at] + upper
        return node

    def sample(self, count: int, rng: np.random.Generator) -> Float:
        """Points of this density: [count, D]. Leaves take turns, in random order."""
        volume = np.prod(self.high - self.low, axis=1)
        cumulative = np.cumsum(np.where(self.axis < 0, self.density * volume, 0))
        turn = (np.arange(count) + rng.random(count)) * (cumulative[-1] / count)
        leaf = np.minimum(np.searchsorted(cumulative, turn, "right"), len(cumulative) - 1)
        rng.shuffle(leaf)
        place = rng.random((count, self.low.shape[1]))
        return self.low[leaf] + place * (self.high - self.low)[leaf]


class _Growing:
    """A tree that is being made, all nodes of a depth at a time."""

    def __init__(self, points: Float, weight: Float) -> None:
        dimension = points.shape[1]
        self.points, self.weight = points, weight / weight.sum()
        self.node = np.zeros(len(points), np.int64)
        self.low, self.high = np.zeros((1, dimension)), np.ones((1, dimension))
        self.axis, self.child = np.full(1, -1), np.zeros(1, np.int64)
        self.fresh, self.depth = 0, 0

    def halve(self) -> bool:
        """Halve the boxes of the last depth that hold enough points; whether there are any."""
        inside = np.flatnonzero(self.node >= self.fresh)
        size = len(self.low) - self.fresh
        count = np.bincount(self.node[inside] - self.fresh, minlength=size)
        parents = self.fresh + np.flatnonzero(count >= LEAST)
        if not len(parents) or self.depth == DEEPEST:
            return False
        order = np.full(len(self.low), -1)
        order[parents] = np.arange(len(parents))
        own = inside[order[self.node[inside]] >= 0]
        self.axis[parents] = self._uneven(own, order[self.node[own]], parents)
        self._divide(own, order[self.node[own]], parents)
        self.depth += 1
        return True

    def _uneven(
        self, own: NDArray[Any], which: NDArray[Any], parents: NDArray[Any]
    ) -> NDArray[np.int64]:
        """The axis of each parent along which its quarters differ most; of equals the longest."""
        low, size = self.low[parents], (self.high - self.low)[parents]
        scores = []
        for axis in range(low.shape[1]):
            place = (self.points[own, axis] - low[which, axis]) / size[which, axis]
            quarter = np.minimum((place * QUARTERS).astype(np.int64), QUARTERS - 1)
            sums = np.bincount(
                which * QUARTERS + quarter, self.weight[own], minlength=len(parents) * QUARTERS
            ).reshape(-1, QUARTERS)
            part = sums / np.maximum(sums.sum(1, keepdims=True), 1e-300)
            scores.append((part * np.log(np.maximum(part, 1e-300))).sum(1) + 1e-3 * size[:, axis])
        return np.argmax(scores, axis=0)

    def _divide(self, own: NDArray[Any], which: NDArray[Any], parents: NDArray[Any]) -> None:
        rows, axis = np.arange(len(parents)), self.axis[parents]
        middle = 0.5 * (self.low + self.high)[parents, axis]
        low, high = np.repeat(self.low[parents], 2, 0), np.repeat(self.high[parents], 2, 0)
        high[2 * rows, axis] = middle
        low[2 * rows + 1, axis] = middle
        first = len(self.low)
        self.child[parents] = first + 2 * rows
        upper = self.points[own, axis[which]] >= middle[which]
        self.node[own] = first + 2 * which + upper
        self.low, self.high = np.concatenate([self.low, low]), np.concatenate([self.high, high])
        self.axis = np.concatenate([self.axis, np.full(2 * len(parents), -1)])
        self.child = np.concatenate([self.child, np.zeros(2 * len(parents), np.int64)])
        self.fresh = first

    def tree(self) -> DensityTree:
        """What has grown."""
        weight = np.bincount(self.node, self.weight, minlength=len(self.low))
        density = weight / np.prod(self.high - self.low, axis=1)
        rows = np.arange(len(self.low))
        along = np.maximum(self.axis, 0)
        middle = 0.5 * (self.low + self.high)[rows, along]
        return DensityTree(self.axis, middle, self.child, self.low, self.high, density)
