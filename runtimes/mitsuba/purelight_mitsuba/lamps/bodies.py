"""Exit surfaces as the bodies of a mesh, with what is looked up by triangle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from purelight_format.measures import Placement
from purelight_format.members.finishes import NONE, Finish
from purelight_format.smooth_normals import corner_normals
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.luminaire import Luminaire


@dataclass(frozen=True)
class Kind:
    """What lamps have in common that may share a body.

    Arguments:
        finishes: Of what they are made, if they are to answer other light.
    """

    luminaire: Luminaire
    finishes: tuple[Finish, ...]

    @staticmethod
    def of(emitter: PureLightEmitter) -> Kind:
        """The kind of a lamp."""
        return Kind(emitter.luminaire, emitter.finishes)

    @property
    def count(self) -> int:
        """Of triangles."""
        return len(self.luminaire.surface.triangles)

    def corner_normals(self) -> np.ndarray:
        """Normals in the corners of the triangles, in the luminaire frame: [3 T, 3]."""
        return corner_normals(self.luminaire.surface, self.finishes).reshape(-1, 3)

    def sides(self, finishes: Sequence[Finish]) -> np.ndarray:
        """Which of some finishes front and back of the triangles have: [T, 2]."""
        number = np.full(NONE + 1, len(finishes), np.uint32)
        number[: len(self.finishes)] = [finishes.index(finish) for finish in self.finishes]
        own = self.luminaire.surface.finish
        return number[np.full((self.count, 2), NONE) if own is None else own]


class Bodies:
    """Lamps' exit surfaces at their places, all kinds in one mesh.

    Arguments:
        kinds: Of each.
        placements: Of each, in the space of the mesh.

    Attributes:
        counts: Of the triangles of each.
        count: Of all triangles.
        first: Where those of each begin: [B].
        smooth: Whether the normals of any are interpolated.
    """

    def __init__(self, kinds: Sequence[Kind], placements: Sequence[Placement]) -> None:
        self._kinds, self._placements = list(kinds), list(placements)
        self.counts = [kind.count for kind in kinds]
        *first, self.count = np.cumsum([0, *self.counts]).tolist()
        self.first = np.array(first, np.uint32)
        self.smooth = any(f.smooth for kind in set(kinds) for f in kind.finishes)

    def normals(self) -> np.ndarray:
        """Geometric unit normals in the luminaire frame: [T, 3]."""
        return self._all(np.float32, lambda kind: kind.luminaire.normals())

    def corner_normals(self) -> np.ndarray:
        """Those in the corners of the triangles, some of them interpolated: [3 T, 3]."""
        return self._all(np.float32, Kind.corner_normals)

    def sides(self, finishes: Sequence[Finish]) -> np.ndarray:
        """Which of some finishes front and back of the triangles have: [T, 2]."""
        return self._all(np.uint32, lambda kind: kind.sides(finishes), columns=2)

    def mesh(self, bsdf: mi.BSDF | None = None, copies: int = 1) -> mi.Mesh:
        """The bodies at their places.

        Arguments:
            copies: How often each triangle is there.
        """
        surfaces = [kind.luminaire.surface for kind in self._kinds]
        pairs = zip(surfaces, self._placements, strict=True)
        positions = [placement.point_to_world(surface.positions) for surface, placement in pairs]
        faces = [surface.triangles.astype(np.uint32) for surface in surfaces]
        if self.smooth:
            positions = [p[f].reshape(-1, 3) for p, f in zip(positions, faces, strict=True)]
            faces = [np.arange(f.size, dtype=np.uint32).reshape(-1, 3) for f in faces]
        *first, total = np.cumsum([0, *map(len, positions)]).tolist()
        props = mi.Properties()
        if bsdf is not None:
            props["bsdf"] = bsdf
        mesh = mi.Mesh(
            "exit surfaces", total, copies * self.count, props, has_vertex_normals=self.smooth
        )
        params = mi.traverse(mesh)
        params["vertex_positions"] = np.concatenate(positions).astype(np.float32).ravel()
        own = [f + np.uint32(start) for f, start in zip(faces, first, strict=True)]
        params["faces"] = np.tile(np.concatenate(own).ravel(), copies)
        if self.smooth:
            turns = [placement.rotation.T for placement in self._placements]
            normals = self._all(np.float32, Kind.corner_normals, turns=turns)
            params["vertex_normals"] = normals.ravel()
        params.update()
        return mesh

    def _all(
        self, dtype: type, of: Callable[[Kind], np.ndarray], columns: int = 3,
        turns: Sequence[np.ndarray] | None = None,
    ) -> np.ndarray:  # fmt: skip
        """What each body has by its kind, asked once of a kind: [..., columns].

        Arguments:
            turns: By what to multiply it, for each body.
        """
        own = {kind: of(kind) for kind in set(self._kinds)}
        parts = [own[kind] for kind in self._kinds]
        if turns is not None:
            parts = [part @ turn for part, turn in zip(parts, turns, strict=True)]
        none = np.zeros((0, columns))
        return np.concatenate([none, *parts], dtype=dtype, casting="unsafe")
