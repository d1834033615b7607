"""A coarse likeness of an exit surface, for who looks at a stage."""

from __future__ import annotations

import numpy as np

from purelight_format.members.surface import Surface

MOST = 2000  # Triangles.
FINEST, COARSER = 256, 0.8  # Cells along the longest side, and by what factor fewer each time.
DIGITS = 4  # Of places, in parts of the longest side.


def guide(surface: Surface, most: int = MOST) -> tuple[np.ndarray, np.ndarray]:
    """The surface itself if it is small, else with the vertices of each cell of a grid made one.

    Returns:
        Positions [V, 3] float32 and triangles [T, 3], at most so many of them but for surfaces
        that fill every grid.
    """
    positions = np.asarray(surface.positions, np.float32).reshape(-1, 3)
    triangles = np.asarray(surface.triangles, np.int64)
    if len(triangles) <= most:
        return positions, triangles
    low = positions.min(0).astype(np.float64)
    side = float((positions.max(0) - low).max()) or 1.0
    cells = FINEST
    while True:
        merged = _merged((positions - low) / side, triangles, cells)
        if len(merged[1]) <= most or cells == 1:
            break
        cells = max(int(COARSER * cells), 1)
    return (low + side * merged[0]).astype(np.float32), merged[1]


def _merged(
    places: np.ndarray, triangles: np.ndarray, cells: int
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices at the means of cells, and the triangles that still have an inside, each once."""
    cell = np.minimum(places * cells, cells - 1).astype(np.int64)
    key, own = np.unique(cell @ [cells * cells, cells, 1], return_inverse=True)
    own = own.ravel()
    number = np.bincount(own)
    mean = np.stack([np.bincount(own, column) / number for column in places.T], 1)
    faces = own[triangles]
    faces = faces[(faces != np.roll(faces, 1, 1)).all(1)]
    _, first = np.unique(np.sort(faces, 1), axis=0, return_index=True)
    used, faces = np.unique(faces[np.sort(first)], return_inverse=True)
    return np.round(mean[used], DIGITS), faces.reshape(-1, 3)
