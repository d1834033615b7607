"""A sheet of metal with rows of holes, as a closed body."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from numpy.typing import NDArray

from purelight_examples.luminaires.parts import solid

Floats = NDArray[np.float64]
GRID = 1e-9  # corners this near are one
Place = Callable[[Floats, bool], Floats]


def pierced(
    columns: int, rows: int, hole: Callable[[Floats], Floats], place: Place, per_side: int = 6
) -> trimesh.Trimesh:
    """A sheet that closes around, with a hole in each of its cells.

    Arguments:
        hole: outline of a hole, its radius below one by the angle in radians; a cell's corners are
            at (±1, ±1).
        place: takes [N, 2] places on the sheet, around and along it from 0 to 1, and whether its
            outer face is meant, to points [N, 3] in metres.
        per_side: corners of the outline along each side of a cell.
    """
    square = _square(per_side)
    angle = np.arctan2(square[:, 1], square[:, 0])
    outline = hole(angle)[:, None] * np.stack((np.cos(angle), np.sin(angle)), 1)
    column, row = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    middle = np.stack((column, row), -1).reshape(-1, 1, 1, 2) + 0.5
    sheet: Floats = (middle + 0.5 * np.stack((square, outline))) / np.array((columns, rows))
    corners, index = np.unique(_keys(sheet.reshape(-1, 2)), axis=0, return_inverse=True)
    count = len(square)
    rim, lip = index.reshape(-1, 2, count).transpose(1, 0, 2)
    flat = np.asarray(corners * GRID, np.float64)
    faces = _faces(rim, lip, flat[:, 1], len(corners))
    return solid(np.concatenate((place(flat, True), place(flat, False))), faces)


def quatrefoil(size: float, leaf: float = 0.52) -> Callable[[Floats], Floats]:
    """Four round leaves: a hole's radius, up to `size`, of which `leaf` is that of a leaf."""
    radius, away = leaf * size, (1 - leaf) * size

    def outline(angle: Floats) -> Floats:
        off = np.mod(angle + np.pi / 4, np.pi / 2) - np.pi / 4  # from the nearest leaf's middle
        return away * np.cos(off) + np.sqrt(radius**2 - (away * np.sin(off)) ** 2)

    return outline


def on_prism(sides: int, outer: float, inner: float, low: float, high: float) -> Place:
    """Places a sheet around an upright prism; the radii are those of its corners."""

    def place(sheet: Floats, outside: bool) -> Floats:
        turn = sides * sheet[:, 0]
        side = np.floor(turn)
        first, last = (2 * np.pi / sides * (side + k) for k in (0, 1))
        part = (turn - side)[:, None]
        corner = [np.stack((np.cos(a), np.sin(a)), 1) for a in (first, last)]
        across = (outer if outside else inner) * ((1 - part) * corner[0] + part * corner[1])
        return np.c_[across, low + (high - low) * sheet[:, 1]]

    return place


def _square(per_side: int) -> Floats:
    """Points around the cell's border from a corner on: [4 per_side, 2]."""
    t = np.linspace(-1, 1, per_side, endpoint=False)
    one = np.ones_like(t)
    return np.concatenate(
        [np.stack(side, 1) for side in ((one, t), (-t, one), (-one, -t), (t, -one))]
    )


def _keys(sheet: Floats) -> NDArray[np.int64]:
    """Places in whole steps of `GRID`; the sheet's end is its beginning."""
    keys = np.rint(sheet / GRID).astype(np.int64)
    keys[:, 0] %= round(1 / GRID)
    return keys


def _faces(
    rim: NDArray[np.int64], lip: NDArray[np.int64], height: Floats, inner: int
) -> NDArray[np.int64]:
    """Both faces of the sheet, the walls of its holes, and those of its two edges.

    Arguments:
        rim, lip: [cells, N] corners around cells and holes.
        height: of all corners; inner: what leads from a corner to that of the inner face.
    """
    rims, lips = (np.stack((ring, np.roll(ring, -1, 1)), -1).reshape(-1, 2) for ring in (rim, lip))
    outside = _quads(rims[:, 0], rims[:, 1], lips[:, 1], lips[:, 0])
    ends = height[rims]
    edge = rims[((ends < GRID) | (ends > 1 - GRID)).all(1)]
    return np.concatenate((
        outside,
        outside[:, ::-1] + inner,
        _quads(lips[:, 0], lips[:, 1], lips[:, 1] + inner, lips[:, 0] + inner),
        _quads(edge[:, 1], edge[:, 0], edge[:, 0] + inner, edge[:, 1] + inner),
    ))  # fmt: skip


def _quads(*corners: NDArray[np.int64]) -> NDArray[np.int64]:
    a, b, c, d = corners
    return np.concatenate((np.stack((a, b, c), 1), np.stack((a, c, d), 1)))
