"""Bins as an appearance network: look-ups in a table, linear in all four dimensions."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.systems.rivals.wcl.bins import FACES, Bins
from purelight_export.graph import Graph, Value
from purelight_format.measures import disk_to_square
from purelight_onnx.session import Session


def appearance(bins: Bins) -> bytes:
    """position, normal, outgoing [N, 3] -> radiance [N, 3] in W/(m² sr)."""
    graph = Graph("appearance")
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    across = abs(normal)  # one of them is 1
    unit = (position - bins.box.centre) * (0.5 / bins.box.half) + 0.5
    place = [_along(graph, across, unit, k) for k in (1, 2)]
    disk = graph.concat([_along(graph, across, outgoing, k) for k in (1, 2)])
    square = [*place, *graph.columns(disk_to_square(disk))]
    weights = graph.constant(2.0 * np.arange(3)[None])
    negative = graph.cast(graph.sum(normal) < 0.0, np.float32)
    face = graph.clip(graph.floor(graph.sum(across * weights) + 0.5) + negative, 0.0, FACES - 1.0)
    sizes = (bins.places, bins.places, bins.directions, bins.directions)
    graph.output("radiance", _looked_up(graph, face, square, sizes, bins))
    return graph.to_bytes()


def _along(graph: Graph, across: Value, vector: Value, step: int) -> Value:
    """The component along an axis of the face: [N, 1]."""
    return graph.sum(across * graph.gather_columns(vector, [(k + step) % 3 for k in range(3)]))


def _looked_up(
    graph: Graph, face: Value, square: list[Value], sizes: tuple[int, ...], bins: Bins
) -> Value:
    """The mean of the 16 bins around, by their nearness: [N, 3]."""
    first, part, lows = graph.cast(face, np.int32), [], []
    for x, size in zip(square, sizes, strict=True):
        at = graph.clip(x * float(size) - 0.5, 0.0, size - 1.0)
        low = graph.clip(graph.floor(at), 0.0, size - 2.0)
        part.append(at - low)
        lows.append(graph.cast(low, np.int32))
    for low, size in zip(lows, sizes, strict=True):
        first = first * size + low
    strides = [int(np.prod(sizes[k + 1 :])) for k in range(4)]
    corners = list(product((0, 1), repeat=4))
    steps = [sum(c * s for c, s in zip(corner, strides, strict=True)) for corner in corners]
    index = first + graph.constant(np.array(steps)[None], np.int32)
    table = graph.constant(bins.values.reshape(-1, 3).astype(np.float32))
    found = graph.reshape(graph.gather(table, index), 3 * len(corners))
    weight = graph.concat([_weight(part, corner) for corner in corners])
    spread = graph.gather_columns(weight, list(np.repeat(np.arange(len(corners)), 3)))
    total = np.tile(np.eye(3), (1, len(corners)))
    return graph.linear(found * spread, total, np.zeros(3))


def _weight(part: list[Value], corner: tuple[int, ...]) -> Value:
    result: Any = None
    for x, upper in zip(part, corner, strict=True):
        factor = x if upper else 1.0 - x
        result = factor if result is None else result * factor
    return result


class Table(nn.Module):
    """The same as a module, for what is trained from it."""

    def __init__(self, model: bytes) -> None:
        super().__init__()
        self._session = Session(model, name="wcl")

    def forward(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """Radiance: three of [N, 3] -> [N, 3]."""
        names = ("position", "normal", "outgoing")
        arrays = [t.numpy() for t in (position, normal, outgoing)]
        return torch.from_numpy(self._session(dict(zip(names, arrays, strict=True)))["radiance"])
