"""Coarse likenesses of meshes, for renderers that read no bundle and those who look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from purelight_format.members.surface import Surface
from purelight_format.usd.appearance_text import KeptPart

PLAIN, FINISHED = 2_000, 8_000  # Triangles of a mere guide, and of a mesh with materials.
FINEST, COARSER = 1024, 0.8  # Cells along the longest side, and by what factor fewer each time.
DIGITS = 4  # Of places, in parts of the longest side.
Mesh = tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.int64]]


def guide(surface: Surface) -> Surface:
    """A likeness of an exit surface. Triangles keep their finishes and their flux."""
    most = PLAIN if surface.finish is None else FINISHED
    positions, triangles, chosen = coarser(surface.positions, surface.triangles, most)
    return replace(
        surface,
        positions=positions,
        triangles=triangles,
        triangle_flux=surface.triangle_flux[chosen],
        finish=None if surface.finish is None else surface.finish[chosen],
    )


def likenesses(parts: Sequence[KeptPart]) -> list[KeptPart]:
    """Likenesses of kept parts, flat where they are coarser, with as many triangles as a guide."""
    share = PLAIN / max(sum(len(part.triangles) for part in parts), PLAIN)
    return [_likeness(part, int(share * len(part.triangles))) for part in parts]


def _likeness(part: KeptPart, most: int) -> KeptPart:
    positions, triangles, _ = coarser(part.positions, part.triangles, most)
    same = len(triangles) == len(part.triangles)
    return part if same else replace(part, positions=positions, triangles=triangles, normals=None)


def coarser(positions: NDArray[np.float32], triangles: NDArray[np.uint32], most: int) -> Mesh:
    """A mesh itself if it is small, else with the vertices of each cell of a grid made one.

    Vertex clustering (Rossignac and Borrel 1993).

    Arguments:
        positions: [V, 3].
        triangles: [T, 3].
        most: triangles that are few enough.

    Returns:
        places, triangles, and which of the triangles each of them was.
    """
    cells, found = FINEST, (positions, triangles, np.arange(len(triangles)))
    while len(found[1]) > most and cells > 1:
        fewer, cells = _clustered(positions, triangles, cells), int(COARSER * cells)
        if not len(fewer[1]):
            break
        found = fewer
    return found


def _clustered(positions: NDArray[np.float32], triangles: NDArray[np.uint32], cells: int) -> Mesh:
    """Vertices at the means of cells, and the triangles that still have an inside, each once."""
    corners = np.asarray(positions, np.float64).reshape(-1, 3)
    low = corners.min(0)
    side = float((corners.max(0) - low).max()) or 1.0
    places = (corners - low) / side
    cell = np.minimum(places * cells, cells - 1).astype(np.int64)
    own = np.unique(cell @ [cells * cells, cells, 1], return_inverse=True)[1].ravel()
    number = np.bincount(own)
    mean = np.stack([np.bincount(own, column) / number for column in places.T], 1)
    faces = own[np.asarray(triangles, np.int64)]
    solid = np.flatnonzero((faces != np.roll(faces, 1, 1)).all(1))
    _, first = np.unique(np.sort(faces[solid], 1), axis=0, return_index=True)
    chosen = solid[np.sort(first)]
    used, compact = np.unique(faces[chosen], return_inverse=True)
    return (
        (low + side * np.round(mean[used], DIGITS)).astype(np.float32),
        compact.reshape(-1, 3).astype(np.uint32),
        chosen,
    )
