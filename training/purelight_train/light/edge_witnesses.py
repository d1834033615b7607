"""Points of a mesh as it was, each with the triangle that is nearest now."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_train.light.edge_ways import Float, Index, Mask, Mesh, Ways

CAREFUL = 0.9  # of the tolerance: there are places between the points


@dataclass(frozen=True)
class Witnesses:
    """The middles of the triangles, and the vertices that are gone.

    Arguments:
        position: [N, 3].
        number: [N] of the triangle, as `Mesh.number` tells them apart.
    """

    position: Float
    number: Index

    @staticmethod
    def of(mesh: Mesh) -> Witnesses:
        return Witnesses(mesh.positions[mesh.corners].mean(1), mesh.number)

    def after(self, mesh: Mesh, ways: Ways) -> tuple[Witnesses, Mask]:
        """The points once vertices have gone those of their ways that leave all of them near.

        Arguments:
            ways: no two of which touch.

        Returns:
            the points, and which of the ways are good: [W].
        """
        count = len(ways.start)
        which = around(mesh, ways)
        place = np.full(int(mesh.number.max(initial=0)) + 1, -1)
        place[mesh.number] = np.arange(len(mesh.number))
        way = which[place[self.number]]
        known = np.flatnonzero(way >= 0)
        points = np.concatenate([self.position[known], mesh.positions[ways.start]])
        way = np.concatenate([way[known], np.arange(count)])
        away, triangle = _nearest(mesh, ways, which, points, way)
        most, slack = np.zeros(count), np.full(count, np.inf)
        np.maximum.at(most, way, away)
        np.minimum.at(slack, which[which >= 0], mesh.tolerance[which >= 0])
        good = most <= CAREFUL * slack
        number, settled = mesh.number[triangle], good[way]
        old, own = settled[: len(known)], settled[len(known) :]
        moved = self.number.copy()
        moved[known[old]] = number[: len(known)][old]
        return Witnesses(
            np.concatenate([self.position, points[len(known) :][own]]),
            np.concatenate([moved, number[len(known) :][own]]),
        ), good


def around(mesh: Mesh, ways: Ways) -> Index:
    """Whose way changes a triangle, -1 if nobody's: [T]."""
    number = np.full(len(mesh.positions), -1)
    number[ways.start] = np.arange(len(ways.start))
    result: Index = number[mesh.corners].max(1)
    return result


def _nearest(
    mesh: Mesh, ways: Ways, which: Index, points: Float, way: Index
) -> tuple[Float, Index]:
    """The distance of points [N] from what a way [N] makes, and the triangle there: [N] each."""
    inside = np.flatnonzero(which >= 0)
    end = ways.end[which[inside]][:, None]
    inside = inside[(mesh.corners[inside] != end).all(1)]  # The others vanish.
    inside = inside[np.argsort(which[inside], kind="stable")]
    number = np.bincount(which[inside], minlength=len(ways.start))
    first = np.cumsum(number) - number
    row = np.repeat(np.arange(len(way)), number[way])
    begin = np.cumsum(number[way]) - number[way]
    triangle = inside[first[way][row] + np.arange(len(row)) - begin[row]]
    own = which[triangle]
    corners = mesh.corners[triangle]
    corners = np.where(corners == ways.start[own][:, None], ways.end[own][:, None], corners)
    closest = trimesh.triangles.closest_point(mesh.positions[corners], points[row])
    away = np.linalg.norm(closest - points[row], axis=1)
    order = np.lexsort((away, row))
    best = order[begin] if len(row) else order
    return away[best], triangle[best]
