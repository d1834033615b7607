"""Floors and walls that are laid: tiles, planks, and a room's shell."""

from __future__ import annotations

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import RGB, Material, Part, matt
from purelight_examples.luminaires.materials import glaze
from purelight_examples.scenes.furniture import Box, boxes, wall

Span = tuple[float, float]
OAK: tuple[RGB, ...] = (
    (0.42, 0.28, 0.16),
    (0.38, 0.245, 0.135),
    (0.46, 0.31, 0.185),
    (0.35, 0.22, 0.12),
)


def shell(x: Span, y: Span, height: float) -> trimesh.Trimesh:
    """Four walls and a ceiling, seen from inside."""
    middle, half = _middle(x, y), _half(x, y)
    (cx, cy), (hx, hy), hz = middle, half, 0.5 * height
    return trimesh.util.concatenate([
        wall((cx, cy, height), -3, (hx, hy)),
        wall((x[0], cy, hz), 1, (hy, hz)), wall((x[1], cy, hz), -1, (hy, hz)),
        wall((cx, y[0], hz), 2, (hz, hx)), wall((cx, y[1], hz), -2, (hz, hx)),
    ])  # fmt: skip


def ground(x: Span, y: Span, color: RGB) -> Part:
    """A plain floor."""
    (cx, cy), half = _middle(x, y), _half(x, y)
    return matt("ground", wall((cx, cy, 0.0), 3, half), color)


def planks(x: Span, y: Span, width: float = 0.12, length: float = 1.3) -> list[Part]:
    """A floor of oak along Y, its boards of four tones, over a dark ground."""
    rows: list[list[Box]] = [[] for _ in OAK]
    for i, left in enumerate(np.arange(x[0], x[1], width)):
        start = y[0] - length * ((0.37 * i) % 1)
        for k, low in enumerate(np.arange(start, y[1], length)):
            ends = max(low, y[0]) + 0.001, min(low + length, y[1]) - 0.001
            right = min(left + width, x[1])
            if ends[1] - ends[0] > 0.02:
                middle = (0.5 * (left + right), 0.5 * sum(ends), 0.004)
                size = (right - left - 0.002, ends[1] - ends[0], 0.008)
                rows[(3 * i + 2 * k + i * k) % len(OAK)].append((middle, size))
    boards = [
        Part(f"planks_{k}", boxes(row), glaze(tone, 0.25))
        for k, (row, tone) in enumerate(zip(rows, OAK, strict=True))
    ]
    return [ground(x, y, (0.08, 0.05, 0.03)), *boards]


def floor_tiles(
    x: Span, y: Span, side: float, tones: tuple[Material, ...], joint: float = 0.003
) -> list[Part]:
    """Square tiles of tones that take turns, over grey joints."""
    rows: list[list[Box]] = [[] for _ in tones]
    for i, left in enumerate(np.arange(x[0], x[1] - 0.01, side)):
        for j, low in enumerate(np.arange(y[0], y[1] - 0.01, side)):
            right, high = min(left + side, x[1]), min(low + side, y[1])
            size = (right - left - joint, high - low - joint, 0.006)
            middle = (0.5 * (left + right), 0.5 * (low + high), 0.003)
            rows[(i + j) % len(tones)].append((middle, size))
    laid = [Part(f"tiles_{k}", boxes(row), tones[k]) for k, row in enumerate(rows)]
    return [ground(x, y, (0.35, 0.34, 0.33)), *laid]


def wall_tiles(x: Span, z: Span, y: float, size: Span, finish: Material) -> Part:
    """Tiles in running bond on a wall across Y, which they stand before towards -Y."""
    found: list[Box] = []
    for row, low in enumerate(np.arange(z[0], z[1] - 0.01, size[1])):
        for left in np.arange(x[0] - 0.5 * size[0] * (row % 2), x[1], size[0]):
            a, b = max(left, x[0]), min(left + size[0], x[1])
            if b - a > 0.01:
                middle = (0.5 * (a + b), y - 0.004, low + 0.5 * size[1])
                found.append((middle, (b - a - 0.003, 0.008, size[1] - 0.003)))
    return Part("wall_tiles", boxes(found), finish)


def _middle(x: Span, y: Span) -> Span:
    return 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])


def _half(x: Span, y: Span) -> Span:
    return 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])
