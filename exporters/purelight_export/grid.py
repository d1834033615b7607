"""The multi-resolution grid as a graph piece; `purelight_train.encodings.GridEncoding` defines it.

All levels and corners of a row are looked up at once, in columns that run through the corners
first and the levels of one corner next.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from purelight_export.encodings import Features
from purelight_export.graph import Graph, Value
from purelight_train.encodings import GridEncoding

CORNERS = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]
PACK = 1 << 15


def grid(graph: Graph, x: Value, encoding: GridEncoding, *, compact: bool = False) -> Features:
    """Multi-resolution grid with trilinear interpolation: [N, 3] in [0, 1] -> levels · features.

    Arguments:
        x: [N, 3], clipped to [0, 1].
        compact: Whether two features share one int32 entry, 15 bits each (half the size).
    """
    levels, features = encoding.levels, encoding.features
    table = encoding.table.detach().cpu().double().numpy()
    if compact:
        quantized, scale, offset = quantize(table, encoding)
        groups = _packed_groups(quantized)
    else:
        scale, offset = np.ones((levels, features)), np.zeros((levels, features))
        groups = [table]
    index, weight = _corners(graph, x, encoding, groups[0].shape[1])
    values = [
        v for group in groups for v in _lookup(graph, group, index, features, compact=compact)
    ]
    sums = graph.concat(
        [_sum_corners(graph, value * weight, levels) for value in values[:features]]
    )
    order = np.arange(levels * features).reshape(features, levels).T.reshape(-1)
    matrix = np.eye(levels * features)[order] * scale.reshape(-1, 1)
    return Features(sums, matrix, offset.reshape(-1))


def quantize(
    table: np.ndarray, encoding: GridEncoding
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integers q in [0, 2^15), with `table = offset + scale q` per level and feature.

    Returns:
        [T, F] int32, scale [L, F], offset [L, F].
    """
    bounds = [*encoding.offsets, len(table)]
    parts = [table[a:b] for a, b in pairwise(bounds)]
    offset = np.stack([part.min(0) for part in parts])
    span = np.stack([part.max(0) for part in parts]) - offset
    scale = np.where(span > 0, span, 1.0) / (PACK - 1)
    codes = [np.rint((part - o) / s) for part, o, s in zip(parts, offset, scale, strict=True)]
    return np.concatenate(codes).astype(np.int32), scale, offset


def _packed_groups(codes: np.ndarray) -> list[np.ndarray]:
    """Pairs of features in one entry: high PACK + low, each group [T, 1]."""
    padded = np.pad(codes, ((0, 0), (0, codes.shape[1] % 2)))
    pairs = range(0, padded.shape[1], 2)
    return [padded[:, k : k + 1] * PACK + padded[:, k + 1 : k + 2] for k in pairs]


def _lookup(
    graph: Graph, table: np.ndarray, index: Value, features: int, *, compact: bool
) -> list[Value]:
    """Values of the features of a table at all corners, each [N, 8 L]."""
    if not compact:
        entries = graph.constant(table.reshape(-1))
        return [graph.gather(entries, index + k if k else index) for k in range(features)]
    pair = graph.gather(graph.constant(table.reshape(-1), np.int32), index)
    high = pair / PACK
    return [graph.cast(high, np.float32), graph.cast(pair - high * PACK, np.float32)]


def _corners(graph: Graph, x: Value, encoding: GridEncoding, entry: int) -> tuple[Value, Value]:
    """Table indices, in units of one of `entry` features, and trilinear weights: [N, 8 L] each."""
    levels, resolution = encoding.levels, np.array(encoding.resolutions, np.float64)
    scale = np.kron(np.eye(3), resolution[:, None])
    scaled = graph.linear(graph.clip(x, 0.0, 1.0), scale, np.zeros(3 * levels))
    low = graph.minimum(graph.floor(scaled), np.tile(resolution - 1, 3))
    high = scaled - low
    sides = [graph.split(1.0 - high, [levels] * 3), graph.split(high, [levels] * 3)]
    weights = [sides[k][2] * sides[j][1] * sides[i][0] for i, j, k in CORNERS]
    return _indices(graph, low, encoding, entry), graph.concat(weights)


def _indices(graph: Graph, low: Value, encoding: GridEncoding, entry: int) -> Value:
    """Table indices of the eight corners of the cells whose low corner is given [N, 3 L]."""
    levels = encoding.levels
    strides = np.array([encoding.strides(level) for level in range(levels)]).T * entry
    ends = np.array([*encoding.offsets[1:], len(encoding.table)])
    sizes, offsets = (ends - encoding.offsets) * entry, np.array(encoding.offsets) * entry
    largest = np.abs(strides * (np.array(encoding.resolutions) + 1)).sum(0).max()
    dtype = np.int32 if max(largest, ends[-1] * entry) < 2**31 else np.int64
    parts = graph.split(graph.cast(low, dtype) * strides.reshape(-1), [levels] * 3)
    corners = np.concatenate([np.array(corner) @ strides for corner in CORNERS])
    first = graph.concat([parts[0] + parts[1] + parts[2]] * 8)
    if all(encoding.dense):
        return first + (corners + np.tile(offsets, 8))
    return graph.binary("Mod", first + corners, np.tile(sizes, 8)) + np.tile(offsets, 8)


def _sum_corners(graph: Graph, values: Value, levels: int) -> Value:
    """Sums the eight corners by halves: [N, 8 L] -> [N, L]."""
    while values.shape[0] > levels:
        low, high = graph.split(values, [values.shape[0] // 2] * 2)
        values = low + high
    return values
