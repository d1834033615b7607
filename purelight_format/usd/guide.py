"""A coarse likeness of an exit surface, for renderers that read no bundle and those who look."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from purelight_format.members.surface import Surface

PLAIN, FINISHED = 2_000, 8_000  # Triangles of a mere guide, and of a mesh with materials.
FINEST, COARSER = 1024, 0.8  # Cells along the longest side, and by what factor fewer each time.
DIGITS = 4  # Of places, in parts of the longest side.


def guide(surface: Surface) -> Surface:
    """The surface itself if it is small, else with the vertices of each cell of a grid made one.

    Vertex clustering (Rossignac and Borrel 1993). Triangles keep their finishes and their flux.
    """
    most = PLAIN if surface.finish is None else FINISHED
    cells, found = FINEST, surface
    while len(found.triangles) > most and cells > 1:
        coarser, cells = _clustered(surface, cells), int(COARSER * cells)
        if not len(coarser.triangles):
            break
        found = coarser
    return found


def _clustered(surface: Surface, cells: int) -> Surface:
    """Vertices at the means of cells, and the triangles that still have an inside, each once."""
    positions = np.asarray(surface.positions, np.float64).reshape(-1, 3)
    low = positions.min(0)
    side = float((positions.max(0) - low).max()) or 1.0
    places = (positions - low) / side
    cell = np.minimum(places * cells, cells - 1).astype(np.int64)
    own = np.unique(cell @ [cells * cells, cells, 1], return_inverse=True)[1].ravel()
    number = np.bincount(own)
    mean = np.stack([np.bincount(own, column) / number for column in places.T], 1)
    faces = own[np.asarray(surface.triangles, np.int64)]
    solid = np.flatnonzero((faces != np.roll(faces, 1, 1)).all(1))
    _, first = np.unique(np.sort(faces[solid], 1), axis=0, return_index=True)
    kept = solid[np.sort(first)]
    used, corners = np.unique(faces[kept], return_inverse=True)
    return replace(
        surface,
        positions=(low + side * np.round(mean[used], DIGITS)).astype(np.float32),
        triangles=corners.reshape(-1, 3).astype(np.uint32),
        triangle_flux=surface.triangle_flux[kept],
        finish=None if surface.finish is None else surface.finish[kept],
    )
