"""Planes that a photometric file leaves out because the lamp is its own mirror image."""

from __future__ import annotations

import numpy as np

NEAR = 1e-3  # Degrees by which angles in files may be off.


def whole_circle(horizontal: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All planes from those that are stored, both ends included.

    One plane stands for all. Half a circle between multiples of 90 degrees is mirrored at the plane
    that it begins with, a quarter at the one it ends with before. What then still is a gap is
    bridged linearly.

    Arguments:
        horizontal: [H] degrees, rising.
        values: [H, ...].

    Returns:
        angles 0 .. 360, rising, and their values.
    """
    if len(horizontal) == 1:
        return np.array([0.0, 360.0]), np.repeat(values, 2, 0)
    begin, span = horizontal[0], horizontal[-1] - horizontal[0]
    at_axis = abs(begin / 90 - round(begin / 90)) * 90 < NEAR
    if at_axis and abs(span - 90) < NEAR:
        horizontal, values = _mirrored(horizontal, values, horizontal[-1])
        span = 180.0
    if at_axis and abs(span - 180) < NEAR:
        horizontal, values = _mirrored(horizontal, values, begin)
    return _closed(horizontal, values)


def symmetry(horizontal: np.ndarray, values: np.ndarray) -> int:
    """The EULUMDAT number of the symmetry that all planes [H, V] have exactly.

    Returns:
        0 for none, 1 about the vertical axis, 2 of the plane C0 - C180, 3 of C90 - C270, 4 of both.
    """
    angle, rows = whole_circle(horizontal, values)
    if (np.ptp(rows, axis=0) == 0).all():
        return 1
    across = _is_mirror(angle, rows, 0.0)
    along = _is_mirror(angle, rows, 90.0)
    return {(True, True): 4, (True, False): 2, (False, True): 3}.get((across, along), 0)


def _is_mirror(angle: np.ndarray, rows: np.ndarray, axis: float) -> bool:
    """Whether each plane has a mirror image with the same values."""
    image = np.round((2 * axis - angle) % 360, 6)
    place = np.searchsorted(angle, image - NEAR).clip(max=len(angle) - 1)
    return bool((abs(angle[place] - image) < 2 * NEAR).all() and (rows[place] == rows).all())


def _mirrored(
    horizontal: np.ndarray, values: np.ndarray, axis: float
) -> tuple[np.ndarray, np.ndarray]:
    both = np.concatenate([horizontal, 2 * axis - horizontal])
    order = np.argsort(both, kind="stable")
    return _apart(both[order], np.concatenate([values, values])[order])


def _closed(horizontal: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles brought into 0 .. 360, with planes at both of these ends."""
    turned = horizontal % 360
    turned[360 - turned < NEAR] = 0
    order = np.argsort(turned, kind="stable")
    angle, rows = _apart(turned[order], values[order])
    if angle[0] > NEAR:
        gap = angle[0] + 360 - angle[-1]
        share = angle[0] / gap
        first = rows[:1] * (1 - share) + rows[-1:] * share
        angle, rows = np.append(0.0, angle), np.concatenate([first, rows])
    angle[0] = 0.0
    return np.append(angle, 360.0), np.concatenate([rows, rows[:1]])


def _apart(angle: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sorted planes without those that repeat the one before."""
    new = np.append(True, np.diff(angle) > NEAR)
    return angle[new], rows[new]
