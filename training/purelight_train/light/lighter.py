"""A lamp whose exit surface has fewer triangles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.decimation import decimated
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.finishes import colors_of, patches
from purelight_train.light.luminaire import Luminaire

AS_IT_IS = -1


def lighter(luminaire: Luminaire, tolerance: float) -> Luminaire:
    """The lamp with its exit surface decimated; what its light is traced through stays.

    Lines between shapes stay, so that each triangle is of one material, and shapes with a texture,
    as their triangles have a finish each.

    Arguments:
        tolerance: most that the surface is moved, over the radius of its bounding sphere.
    """
    if tolerance <= 0:
        return luminaire
    surface = decimated(luminaire.exit_surface, tolerance, _shapes(luminaire))
    return replace(luminaire, exit_surface=surface)


def chosen_of(whole: ExitSurface, fewer: ExitSurface) -> NDArray[np.int64]:
    """Which of the triangles of a surface each of a decimated one is: [T]."""
    assert whole.source is not None
    assert fewer.source is not None
    order = np.argsort(whole.source)
    result: NDArray[np.int64] = order[np.searchsorted(whole.source[order], fewer.source)]
    return result


def _shapes(luminaire: Luminaire) -> NDArray[np.int64]:
    """The shape of each triangle, `AS_IT_IS` for those with a texture: [T]."""
    label = np.zeros(len(luminaire.exit_surface.triangles), np.int64)
    for number, patch in enumerate(patches(luminaire.scene, luminaire.exit_surface), 1):
        label[patch.triangles] = AS_IT_IS if colors_of([patch]) is not None else number
    return label
