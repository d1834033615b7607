"""The bodies of a lamp that light passes: what each scatters where it stands."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from purelight_format.limits import LIMITS
from purelight_format.members.finishes import Finish
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.finish_scatter import ScatterFit
from purelight_train.light.luminaire import Luminaire, scene_triangles, triangle_counts

MOST = 16  # bodies of one material that are fitted each on its own
ALIKE = 0.03  # of even light: a body that scatters nearer to the mean of all has its finish
Indices = NDArray[np.int64]


def with_bodies(
    luminaire: Luminaire, made: Sequence[Finish], sides: Indices
) -> tuple[list[Finish], Indices]:
    """Finishes that light passes, with what they scatter; a sheet has the same on both sides.

    A body that scatters otherwise than all of its material do together has a finish of its own: a
    petal before others, a globe that hangs in a shade.

    Arguments:
        made: finishes of the materials alone.
        sides: [T, 2] which of them each side of each triangle has, -1 for none.

    Returns:
        finishes, the given ones first, and `sides` with them.
    """
    result, sides = list(made), sides.copy()
    clear = [k for k, f in enumerate(made) if not f.opaque and (sides[:, 0] == k).any()]
    if not clear:
        return result, sides
    fit, surface = ScatterFit(luminaire), luminaire.exit_surface
    assert surface.source is not None
    body_of = bodies(luminaire.scene)
    most = min(MOST, max(LIMITS.finishes - len(made), 0) // len(clear))
    for index in clear:
        finish, triangles = made[index], np.flatnonzero(sides[:, 0] == index)
        result[index] = whole = fit(finish, triangles, index)
        if finish.thin_walled:
            sides[triangles, 1] = index
        for part in _parted(triangles, body_of[surface.source[triangles]], surface)[:most]:
            own = fit(finish, part, len(result)) if len(part) < len(triangles) else whole
            if _apart(own, whole) > ALIKE:
                sides[part] = np.where(sides[part] == index, len(result), sides[part])
                result.append(own)
    return result, sides


def bodies(scene: mi.Scene) -> Indices:
    """The number of the body that each triangle of a scene belongs to: [S].

    Triangles of one material hang together by their corners, whether they are seen or not.
    """
    positions, triangles, _ = scene_triangles(scene)
    bsdfs = dr.reinterpret_array(mi.UInt32, mi.BSDFPtr([s.bsdf() for s in scene.shapes()]))
    material = np.repeat(np.array(bsdfs), 3 * np.array(triangle_counts(scene)))
    corners = np.column_stack((positions[triangles.ravel()], material))
    a, b, c = np.unique(corners, axis=0, return_inverse=True)[1].reshape(-1, 3).T
    ends = np.concatenate((a, b)), np.concatenate((b, c))
    links = coo_matrix((np.ones(len(ends[0])), ends), (len(corners),) * 2)
    result: Indices = connected_components(links, directed=False)[1][a].astype(np.int64)
    return result


def _parted(triangles: Indices, body_of: Indices, surface: ExitSurface) -> list[Indices]:
    """Triangles [P] of an exit surface by their bodies [P]: the largest ones first."""
    label = np.unique(body_of, return_inverse=True)[1].ravel()
    order = np.argsort(-np.bincount(label, surface.triangle_area[triangles]), kind="stable")
    return [triangles[label == k] for k in order]


def _apart(a: Finish, b: Finish) -> float:
    """The part of even light by which two finishes scatter otherwise, ahead and back."""
    ahead, back = (
        np.abs(np.subtract(getattr(a, name), getattr(b, name))).max()
        for name in ("scattered_ahead", "scattered_back")
    )
    return float(ahead + back)
