"""An exit surface with fewer triangles where it is flat, or nearly so.

Each connected piece is simplified by collapsing edges in the order of their quadric error (Garland
and Heckbert 1997, by the library fast-simplification), as far as it stays within a tolerance of
the surface, measured both ways: from points of either, the other is met within the tolerance along
the normal, by a triangle that faces the same way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import fast_simplification
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from purelight_train.light.exit_surface import ExitSurface, Float, proper

Index = NDArray[np.int64]
TOLERANCE = 1e-3  # of the bounding sphere's radius: most that a surface may be moved
ANGLE = 8.0  # degrees: most that a normal may be turned
TURNED = 0.01  # of a piece's area, of what is smaller than the tolerance, may be turned further
LEFT = 0.02 * 1.3 ** np.arange(15)  # parts of a piece's triangles to try, the least first
FEW = 16  # one in so many points is asked before all are
LEAST = 32  # triangles of a piece that is worth simplifying
AGGRESSIVENESS = 7.0  # of the library: how fast its thresholds grow
NEIGHBOURS = 8
MOST_EXACT = 100  # points that rays missed, whose distance is looked up
START = 1e-2  # of the tolerance: how far behind a point its rays begin
WAYS = np.array([
    [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1],
])  # fmt: skip


@dataclass(frozen=True)
class _Piece:
    """A connected part of a surface.

    Arguments:
        positions, triangles: Of the part alone, vertices in common where they are at one place.
        fringed: The same with a triangle upright on each edge of the boundary, which keeps the
            boundary in its place; positions in units of the tolerance.
        collapses: [N, 2] edges of that in their order.
    """

    positions: Float
    triangles: NDArray[np.int32]
    fringed: tuple[Float, NDArray[np.int32]]
    collapses: NDArray[np.int32]

    @staticmethod
    def of(positions: Float, triangles: Index, reach: float) -> _Piece:
        """From triangles over positions of a whole surface, and a tolerance in metres."""
        used, own = np.unique(triangles, return_inverse=True)
        corner, faces = positions[used], own.reshape(-1, 3).astype(np.int32)
        # The library knows thresholds of its own for squared distances, from 1e-6 on
        fringed = _fringed((corner.astype(np.float64) - corner.mean(0)) / reach, faces)
        collapses = np.zeros((0, 2), np.int32)
        if len(faces) >= LEAST:
            *_, collapses = fast_simplification.simplify(
                *fringed, target_count=4, agg=AGGRESSIVENESS, return_collapses=True
            )
        return _Piece(corner, faces, fringed, collapses)

    def after(self, count: int, reach: float) -> tuple[Float, Index]:
        """Positions and triangles after the first `count` collapses."""
        if not count:
            return self.positions, self.triangles.astype(np.int64)
        moved, _, new = fast_simplification.replay_simplification(
            *self.fringed, self.collapses[:count]
        )
        faces = new[self.triangles].astype(np.int64)
        faces = faces[(faces != np.roll(faces, 1, 1)).all(1)]
        used, own = np.unique(faces, return_inverse=True)
        positions = moved[used] * reach + self.positions.mean(0, dtype=np.float64)
        return positions.astype(np.float32), own.reshape(-1, 3)


def _fringed(
    positions: NDArray[np.float64], triangles: NDArray[np.int32]
) -> tuple[Float, NDArray[np.int32]]:
    """Triangles, and more that stand upright on those edges that only one of them has."""
    a, b, c = positions[triangles.T]
    normal = _unit(np.cross(b - a, c - a))
    start, end = _open_edges(triangles)
    first, last = triangles.ravel()[start], triangles.ravel()[end]
    length = np.linalg.norm(positions[last] - positions[first], axis=1, keepdims=True)
    tip = (positions[first] + positions[last]) / 2 + length * normal[start // 3]
    fringe = np.column_stack([last, first, len(positions) + np.arange(len(tip))])
    return (
        np.concatenate([positions, tip]).astype(np.float32),
        np.concatenate([triangles, fringe]).astype(np.int32),
    )


def _open_edges(triangles: NDArray[np.integer]) -> tuple[Index, Index]:
    """The corners [N], of all 3 T, between which edges run that only one triangle has."""
    corner = np.arange(triangles.size)
    following = corner - corner % 3 + (corner + 1) % 3
    ends = np.sort(np.stack([triangles.ravel(), triangles.ravel()[following]], 1), 1)
    _, first, number = np.unique(ends, axis=0, return_index=True, return_counts=True)
    start = first[number == 1]
    return start, following[start]


def decimated(
    surface: ExitSurface, tolerance: float = TOLERANCE, angle: float = ANGLE
) -> ExitSurface:
    """The surface with fewer triangles.

    Arguments:
        tolerance: Most that it is moved, over the radius of the bounding sphere; nothing is
            changed if it is zero.
        angle: Most that normals are turned, in degrees.
    """
    if tolerance <= 0:
        return surface
    reach, cosine = tolerance * surface.sphere.radius, float(np.cos(np.radians(angle)))
    owner, pieces = _pieces(surface, reach)
    judge = _Judge(surface, owner, reach, cosine)
    most = np.array([len(piece.collapses) for piece in pieces])
    kept, asked = np.zeros(len(pieces), np.int64), most > 0
    for left in LEFT:
        counts = np.where(asked, most - (left * most).astype(np.int64), kept)
        good = judge.accepts(*_joined(pieces, counts, reach), asked) & asked
        kept, asked = np.where(good, counts, kept), asked & ~good
        if not asked.any():
            break
    kept[~judge.accepts(*_joined(pieces, kept, reach), kept > 0)] = 0  # Each was beside others.
    return _dressed(*_joined(pieces, kept, reach), surface, owner)


def _pieces(surface: ExitSurface, reach: float) -> tuple[Index, list[_Piece]]:
    """The piece of each triangle, and the pieces."""
    positions, corner = np.unique(surface.positions, axis=0, return_inverse=True)
    triangles = corner.ravel()[surface.triangles].astype(np.int64)
    row, column = triangles[:, :2].T.ravel(), triangles[:, 1:].T.ravel()
    graph = coo_matrix((np.ones(len(row)), (row, column)), (len(positions),) * 2)
    label = connected_components(graph, directed=False)[1][triangles[:, 0]]
    owner = np.unique(label, return_inverse=True)[1].ravel()
    order = np.argsort(owner, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(owner[order])) + 1)
    return owner, [_Piece.of(positions, triangles[part], reach) for part in parts]


def _joined(pieces: list[_Piece], counts: Index, reach: float) -> tuple[ExitSurface, Index]:
    """The pieces after so many collapses of each, and the piece of each triangle."""
    found = [piece.after(int(count), reach) for piece, count in zip(pieces, counts, strict=True)]
    first = np.cumsum([0, *(len(positions) for positions, _ in found)])
    triangles = [faces + start for (_, faces), start in zip(found, first, strict=False)]
    owner = np.repeat(np.arange(len(found)), [len(faces) for faces in triangles])
    every = np.concatenate(triangles).astype(np.uint32)
    bare = ExitSurface(np.concatenate([p for p, _ in found]), every, np.zeros(len(every), bool))
    return bare, owner


@dataclass(frozen=True)
class _Probes:
    """Points of a surface, from which another one is looked for.

    Arguments:
        position, normal: [N, 3].
        piece: [N].
        area: [N] that a point stands for when normals are compared, over that of its piece.
    """

    position: Float
    normal: Float
    piece: Index
    area: NDArray[np.float64]

    @staticmethod
    def of(surface: ExitSurface, owner: Index, reach: float) -> _Probes:
        """The middles of the triangles, which stand for their area, and the vertices.

        Vertices of the boundary lie inwards by half the reach, lest rays pass by.
        """
        corners, normal = surface.positions[surface.triangles], surface.outward_normals()
        positions, at = np.unique(surface.positions, axis=0, return_inverse=True)
        vertex = at.ravel()[surface.triangles]
        mean, middle = np.zeros((2, len(positions), 3))
        np.add.at(mean, vertex, (normal * surface.triangle_area[:, None])[:, None])
        np.add.at(middle, vertex, corners.mean(1)[:, None] - corners)
        edge = np.zeros(len(positions), bool)
        edge[vertex.reshape(-1)[_open_edges(vertex)[0]]] = True
        moved = positions + 0.5 * reach * edge[:, None] * _unit(middle)
        piece = np.zeros(len(mean), np.int64)
        piece[vertex] = owner[:, None]
        part = surface.triangle_area / np.bincount(owner, surface.triangle_area)[owner]
        return _Probes(
            np.concatenate([corners.mean(1), moved]).astype(np.float32),
            np.concatenate([normal, _unit(mean)]).astype(np.float32),
            np.concatenate([owner, piece]),
            np.concatenate([part, np.zeros(len(mean))]),
        )

    @staticmethod
    def drawn(surface: ExitSurface, owner: Index, wanted: NDArray[np.bool_], most: int) -> _Probes:
        """Points of wanted pieces [P], at most so many, even by area, and one of each triangle."""
        area = surface.triangle_area * wanted[owner]
        rng, count = np.random.default_rng(0), min(most, 3 * int(np.count_nonzero(area)))
        even = rng.choice(len(area), count, p=area / area.sum())
        triangle = np.concatenate([even, np.flatnonzero(area)])
        part = np.zeros(len(triangle))
        part[:count] = 1 / np.bincount(owner[even])[owner[even]]
        return _Probes(
            surface.points_of(triangle, rng.random((2, len(triangle)))),
            surface.outward_normals()[triangle].astype(np.float32),
            owner[triangle], part,
        )  # fmt: skip

    def take(self, chosen: NDArray[np.bool_]) -> _Probes:
        """The points where a mask [N] is true."""
        names = ("position", "normal", "piece", "area")
        return _Probes(*(getattr(self, name)[chosen] for name in names))

    def some(self, wanted: NDArray[np.bool_], every: int) -> _Probes:
        """One in so many of the points of wanted pieces [P], less those."""
        return self.take(wanted[self.piece] & (np.arange(len(self.piece)) % every == 0))

    def lost(self, other: ExitSurface, reach: float) -> NDArray[np.bool_]:
        """Which points have nothing of another surface within reach: [N].

        Looked for along the normal, then in other directions: a ray may slip through at an edge.
        """
        left = np.ones(len(self.position), bool)
        for direction in (self.normal, *_unit(WAYS)):
            index = np.flatnonzero(left)
            if not len(index):
                break
            along = np.broadcast_to(direction, self.position.shape)[index].astype(np.float32)
            left[index] = _nearest(other, self.position[index], along, reach)[0] > reach
        index = np.flatnonzero(left)
        if len(index) <= MOST_EXACT:  # More are no accident of rays.
            left[index] = _distance(other, self.position[index], reach) > reach
        return left

    def turned(
        self, other: ExitSurface, owner: Index, reach: float, cosine: float
    ) -> NDArray[np.bool_]:
        """Which points meet their piece of another surface where it faces another way: [N]."""
        distance, triangle = _nearest(other, self.position, self.normal, reach)
        facing = np.einsum("nd,nd->n", other.outward_normals()[triangle], self.normal)
        own = (distance <= reach) & (owner[triangle] == self.piece)
        result: NDArray[np.bool_] = own & (facing < cosine)
        return result


@dataclass(frozen=True)
class _Judge:
    """Tells which pieces of simpler surfaces are near enough to a surface.

    Arguments:
        owner: The piece of each triangle of the surface.
        reach: Most that it may be moved, in metres; cosine: of the most that it may be turned.
    """

    surface: ExitSurface
    owner: Index
    reach: float
    cosine: float

    @cached_property
    def _probes(self) -> _Probes:
        """Points of the surface that it finds itself from."""
        probes = _Probes.of(self.surface, self.owner, self.reach)
        return probes.take(~probes.lost(self.surface, self.reach))

    def accepts(
        self, simple: ExitSurface, owner: Index, asked: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Which pieces: [P]; those that are not asked for [P] are.

        Arguments:
            owner: The piece of each triangle of the simpler surface.
        """
        good = np.ones(len(asked), bool)
        for every in (FEW, 1):
            if not (asked & good).any():
                return good
            probes = self._probes.some(asked & good, every)
            good &= self._finds(probes, simple, owner, len(asked))
        if (asked & good).any():
            count = len(self.surface.triangles)
            probes = _Probes.drawn(simple, owner, asked & good, count)
            good &= self._finds(probes, self.surface, self.owner, len(asked))
        return good

    def _finds(
        self, probes: _Probes, other: ExitSurface, owner: Index, pieces: int
    ) -> NDArray[np.bool_]:
        """Whose points find another surface near and facing as they do: [P]."""
        lost = probes.lost(other, self.reach)
        turned = probes.turned(other, owner, self.reach, self.cosine)
        near = np.bincount(probes.piece[lost], minlength=pieces) == 0
        return near & (np.bincount(probes.piece, probes.area * turned, pieces) <= TURNED)


def _nearest(
    other: ExitSurface, position: Float, along: Float, reach: float
) -> tuple[NDArray[np.float64], Index]:
    """What is met first from points [N, 3], forwards and backwards along directions [N, 3].

    Returns:
        Its distance, infinite if there is nothing, and its triangle: [N] each.
    """
    distance, triangle = np.full(len(position), np.inf), np.zeros(len(position), np.int64)
    for way in (along, -along):
        hits = other.intersect(position - np.float32(START * reach) * way, way)
        length = np.linalg.norm(hits.position - position[hits.index], axis=1)
        nearer = length < distance[hits.index]
        index = hits.index[nearer]
        distance[index], triangle[index] = length[nearer], hits.triangle[nearer]
    return distance, triangle


def _distance(other: ExitSurface, position: Float, reach: float) -> NDArray[np.float64]:
    """The distance of points [N, 3] to a surface, infinite where it is beyond reach: [N]."""
    result, corners = np.full(len(position), np.inf), other.positions[other.triangles]
    low, high = corners.min(1) - reach, corners.max(1) + reach
    for index, point in enumerate(position):
        near = corners[((low <= point) & (point <= high)).all(1)].astype(np.float64)
        if len(near):
            closest = trimesh.triangles.closest_point(near, np.tile(point, (len(near), 1)))
            result[index] = np.linalg.norm(closest - point, axis=1).min()
    return result


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length: NDArray[np.float64] = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(length, 1e-30)


def _dressed(simple: ExitSurface, owner: Index, original: ExitSurface, of: Index) -> ExitSurface:
    """A simpler surface with the sides and the shading normals of the original.

    Arguments:
        owner, of: The piece of each triangle, of the simpler one and of the original.
    """
    piece = np.zeros(len(simple.positions), np.int64)
    piece[simple.triangles] = owner[:, None]
    kept = proper(simple.positions, simple.triangles)
    used, compact = np.unique(kept, return_inverse=True)
    positions, triangles = simple.positions[used], compact.reshape(-1, 3).astype(np.uint32)
    bare = ExitSurface(positions, triangles, np.zeros(len(triangles), bool))
    owner = piece[used][triangles[:, 0]]
    middles = _marked(original.positions[original.triangles].mean(1), of, original)
    near = cKDTree(middles).query(_marked(positions[triangles].mean(1), owner, original))[1]
    bare = replace(bare, two_sided=original.two_sided[near])
    smooth = original.vertex_normals
    return bare if smooth is None else _shaded(bare, owner, original, of, smooth)


def _shaded(
    bare: ExitSurface, owner: Index, original: ExitSurface, of: Index, smooth: Float
) -> ExitSurface:
    """The surface with vertices apart where their shading normals differ.

    Of the nearest vertices of the original, a corner takes the normal that fits its triangle best.
    """
    piece = np.zeros(len(original.positions), np.int64)
    piece[original.triangles] = of[:, None]
    tree = cKDTree(_marked(original.positions, piece, original))
    corners = bare.positions[bare.triangles].reshape(-1, 3)
    marked = _marked(corners, np.repeat(owner, 3), original)
    near = tree.query(marked, k=min(NEIGHBOURS, len(original.positions)))[1]
    normal = np.repeat(bare.outward_normals(), 3, axis=0)
    fit = np.einsum("nkd,nd->nk", smooth[near], normal)
    best = smooth[near[np.arange(len(near)), np.argmax(fit, 1)]]
    rows, index = np.unique(np.column_stack([corners, best]), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3).astype(np.uint32)
    return ExitSurface(rows[:, :3].copy(), triangles, bare.two_sided, rows[:, 3:].copy())


def _marked(points: Float, piece: Index, original: ExitSurface) -> NDArray[np.float64]:
    """Points [N, 3] with their piece as a fourth coordinate, so that pieces are far apart."""
    return np.column_stack([points, 10 * original.sphere.radius * piece])
