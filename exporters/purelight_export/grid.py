"""The multi-resolution grid (`purelight_train.networks.encodings.GridEncoding`) as a graph piece.

All corners and levels of a row are looked up at once. A lookup brings the entry's whole row of
the table, so columns run through the corners, then the levels, then the elements of an entry.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from purelight_export.encodings import Features
from purelight_export.graph import Graph, Value
from purelight_train.networks.encodings import GridEncoding

CORNERS = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]
PACK = 1 << 15


def grid(graph: Graph, x: Value, encoding: GridEncoding, *, compact: bool = False) -> Features:
    """Multi-resolution grid with trilinear interpolation: [N, 3] in [0, 1] -> levels · features.

    Arguments:
        x: [N, 3], clipped to [0, 1].
        compact: Whether two features share one int32 element, 15 bits each (half the size).
    """
    table = encoding.table.detach().cpu().double().numpy()
    x = graph.clip(x, 0.0, 1.0)
    if not compact:
        value = _interpolated(graph, x, encoding, graph.constant(table))
        return Features(value, np.eye(table.shape[1] * encoding.levels), np.zeros(value.shape))
    codes, scale, offset = quantize(table, encoding)
    value = _interpolated(graph, x, encoding, graph.constant(pack(codes), np.int32))
    return Features(value, _unpacked_columns(*scale.shape) * scale.reshape(-1, 1), offset.ravel())


def quantize(
    table: np.ndarray, encoding: GridEncoding
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integers q in [0, 2^15), with `table = offset + scale q` per level and feature.

    Returns:
        [T, F] int32, scale [L, F], offset [L, F].
    """
    parts = [table[a:b] for a, b in pairwise([*encoding.offsets, len(table)])]
    offset = np.stack([part.min(0) for part in parts])
    span = np.stack([part.max(0) for part in parts]) - offset
    scale = np.where(span > 0, span, 1.0) / (PACK - 1)
    codes = [np.rint((part - o) / s) for part, o, s in zip(parts, offset, scale, strict=True)]
    return np.concatenate(codes).astype(np.int32), scale, offset


def pack(codes: np.ndarray) -> np.ndarray:
    """Features [T, F] in pairs, first 2^15 + second: [T, ceil(F / 2)] int32."""
    padded = np.pad(codes, ((0, 0), (0, codes.shape[1] % 2)))
    return padded[:, ::2] * PACK + padded[:, 1::2]


def _unpacked_columns(levels: int, features: int) -> np.ndarray:
    """Matrix from the columns (half, level, pair) of packed values to (level, feature)."""
    pairs = -(-features // 2)
    level, feature = np.divmod(np.arange(levels * features), features)
    column = (feature % 2 * levels + level) * pairs + feature // 2
    return np.eye(2 * levels * pairs)[column]


def _interpolated(graph: Graph, x: Value, encoding: GridEncoding, table: Value) -> Value:
    """Trilinear interpolation of a table [T, E]: -> [N, levels E], or both halves if packed."""
    levels, elements = encoding.levels, table.shape[1]
    entries = graph.gather(table, _indices(graph, x, encoding))
    entries = graph.reshape(entries, 8 * levels * elements)
    weight = _weights(graph, x, np.repeat(np.array(encoding.resolutions, float), elements))
    if table.dtype != np.int32:
        return _sum_corners(graph, entries * weight)
    high = entries / PACK
    halves = (graph.cast(half, np.float32) for half in (high, entries - high * PACK))
    return graph.concat([_sum_corners(graph, half * weight) for half in halves])


def _cells(graph: Graph, x: Value, resolution: np.ndarray) -> tuple[Value, Value]:
    """Scaled coordinates and their cells, all x first: [N, 3] -> two of [N, 3 R]."""
    scale = np.kron(np.eye(3), resolution[:, None])
    scaled = graph.linear(x, scale, np.zeros(len(scale)))
    return scaled, graph.minimum(graph.floor(scaled), np.tile(resolution - 1, 3))


def _weights(graph: Graph, x: Value, resolution: np.ndarray) -> Value:
    """Trilinear weights of the corners: [N, 3] -> [N, 8 R]."""
    scaled, cell = _cells(graph, x, resolution)
    high = scaled - cell
    sides = [graph.split(side, [len(resolution)] * 3) for side in (1.0 - high, high)]
    return graph.concat([sides[k][2] * sides[j][1] * sides[i][0] for i, j, k in CORNERS])


def _indices(graph: Graph, x: Value, encoding: GridEncoding) -> Value:
    """Table rows of the corners of each level's cell: [N, 3] -> [N, 8 L]."""
    levels, resolution = encoding.levels, np.array(encoding.resolutions)
    strides = np.array([encoding.strides(level) for level in range(levels)]).T
    rows, offsets = len(encoding.table), np.tile(encoding.offsets, 8)
    largest = max(rows, np.abs(strides * (resolution + 1)).sum(0).max())
    _, cell = _cells(graph, x, resolution.astype(float))
    steps = graph.cast(cell, np.int32 if largest < 2**31 else np.int64) * strides.reshape(-1)
    along = graph.split(steps, [levels] * 3)
    first = graph.concat([along[0] + along[1] + along[2]] * 8)
    corners = np.concatenate([np.array(corner) @ strides for corner in CORNERS])
    if all(encoding.dense):
        return first + (corners + offsets)
    sizes = np.tile(np.diff([*encoding.offsets, rows]), 8)
    return graph.binary("Mod", first + corners, sizes) + offsets


def _sum_corners(graph: Graph, values: Value) -> Value:
    """Sums the eight corners by halves: [N, 8 D] -> [N, D]."""
    for _ in range(3):
        low, high = graph.split(values, [values.shape[0] // 2] * 2)
        values = low + high
    return values
