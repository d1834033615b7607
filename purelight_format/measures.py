"""Frames, disk maps and caps: the NumPy reference that every other implementation must equal.

All functions calculate in the floating-point type of their arguments. Equation numbers refer to
spec/measures.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

QUARTER_PI = math.pi / 4
FAR = 1e15  # Radii; farther points count as this far, so that squares stay finite in float32.
OUTSIDE = 1 + 1e-6  # Radii; a nearer point is served as if it were inside the sphere.
AHEAD = 1.5  # Bound on 1 - cos that tells the axis from its opposite, where x = y = 0 as well.


@dataclass(frozen=True)
class BoundingSphere:
    """A sphere around the exit surface, in the luminaire frame.

    Arguments:
        center: its centre in metres.
        radius: its radius in metres.
    """

    center: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class Cap:
    """The cap of directions in which a sphere is seen from each of N points.

    Arguments:
        axis: [N, 3] unit direction to the centre, +Z at the centre itself.
        one_minus_cos: [N] of the half-angle; 1 for points on or in the sphere.
        outside: [N] whether the point is outside the sphere.
    """

    axis: np.ndarray
    one_minus_cos: np.ndarray
    outside: np.ndarray

    @property
    def solid_angle(self) -> np.ndarray:
        """Solid angle of the cap, 2 pi (1 - cos): [N] in sr."""
        return 2 * math.pi * self.one_minus_cos


def frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r"""Completes unit axes n to right-handed frames, :math:`t \times b = n` (Eq. 1).

    Arguments:
        axis: [N, 3] unit vectors; the only singular one is (0, 0, -1).

    Returns:
        tangent and bitangent, [N, 3] each.
    """
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    rho = x * x + y * y
    below = z < 0
    pole = below & (rho < 1e-20)
    k = np.where(below, (1 - z) / np.where(pole | ~below, 1, rho), 1 / (1 + np.abs(z)))
    xx, xy, yy = (np.where(pole, at, k * a * b) for at, a, b in ((2, x, x), (0, x, y), (0, y, y)))
    return np.stack((1 - xx, -xy, -x), -1), np.stack((-xy, 1 - yy, -y), -1)


def square_to_disk(u: np.ndarray) -> np.ndarray:
    """Equal-area concentric map of the unit square to the unit disk (Eq. 2).

    Shirley and Chiu, "A Low Distortion Map Between Disk and Square", 1997.

    Arguments:
        u: [N, 2] in [0, 1].

    Returns:
        [N, 2] points with x² + y² <= 1.
    """
    a, b = 2 * u[..., 0] - 1, 2 * u[..., 1] - 1
    horizontal = np.abs(a) > np.abs(b)
    r, minor = np.where(horizontal, a, b), np.where(horizontal, b, a)
    phi = QUARTER_PI * (minor / np.where(r == 0, 1, r))
    along, across = r * np.cos(phi), r * np.sin(phi)
    x, y = np.where(horizontal, along, across), np.where(horizontal, across, along)
    return np.stack((x, y), -1)


def disk_to_square(p: np.ndarray) -> np.ndarray:
    """Inverse of `square_to_disk` (Eq. 3): [N, 2] in the unit disk -> [N, 2] in [0, 1]."""
    x, y = p[..., 0], p[..., 1]
    horizontal = np.abs(x) > np.abs(y)
    major, minor = np.where(horizontal, x, y), np.where(horizontal, y, x)
    r = np.copysign(np.sqrt(x * x + y * y), major)
    t = r * np.arctan(minor / np.where(major == 0, 1, major)) / QUARTER_PI
    a, b = np.where(horizontal, r, t), np.where(horizontal, t, r)
    return np.clip(np.stack((a, b), -1) / 2 + 0.5, 0, 1)


def cap(point: np.ndarray, sphere: BoundingSphere) -> Cap:
    r"""Returns the cap that a sphere covers, with :math:`1-\cos\theta = s^2/(1+\sqrt{1-s^2})`,
    :math:`s = \min(1, R/d)`: free of cancellation at any distance (Eq. 4).

    Arguments:
        point: [N, 3] in metres.
        sphere: the sphere.

    >>> seen = cap(np.array([[0, 0, 2.0]]), BoundingSphere((0, 0, 0), 1.0))
    >>> seen.axis, seen.solid_angle.round(4)
    (array([[ 0.,  0., -1.]]), array([0.8418]))
    """
    offset, distance = _offset(point, sphere)
    safe = np.where(distance > 0, distance, 1)
    up = np.array([0, 0, 1], offset.dtype)
    axis = np.where(distance[..., None] > 0, offset / safe[..., None], up)
    s = 1 / np.maximum(distance, 1)
    return Cap(axis, s * s / (1 + np.sqrt(1 - s * s)), distance > OUTSIDE)


def _offset(point: np.ndarray, sphere: BoundingSphere) -> tuple[np.ndarray, np.ndarray]:
    """Vector to the centre in radii [N, 3] and its length [N]."""
    centre = np.array(sphere.center, point.dtype)
    radius = point.dtype.type(sphere.radius)
    offset = np.clip((centre - point) / radius, -FAR, FAR)
    return offset, np.sqrt((offset * offset).sum(-1))


def cap_to_direction(u: np.ndarray, cap: Cap) -> np.ndarray:
    """Equal-area map of the unit square onto the cap (Eq. 5).

    A density on the square gives `pdf_solid_angle = pdf_square / cap.solid_angle`.

    Arguments:
        u: [N, 2] in [0, 1].
        cap: the caps of N points.

    Returns:
        [N, 3] unit directions.
    """
    tangent, bitangent = frame(cap.axis)
    disk = square_to_disk(u)
    m = (disk * disk).sum(-1) * cap.one_minus_cos
    q = np.sqrt(cap.one_minus_cos * (2 - m))
    x, y = (q * disk[..., 0])[..., None], (q * disk[..., 1])[..., None]
    return cap.axis * (1 - m)[..., None] + (x * tangent + y * bitangent)


def direction_to_cap(toward: np.ndarray, cap: Cap) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of `cap_to_direction` (Eq. 6).

    Arguments:
        toward: [N, 3] unit directions.
        cap: the caps of N points.

    Returns:
        square coordinates [N, 2], those of the nearest rim point for directions beside the cap;
        and [N] whether the direction is inside.
    """
    tangent, bitangent = frame(cap.axis)
    delta = toward - cap.axis
    m = (delta * delta).sum(-1) / 2
    q = np.sqrt(np.maximum(cap.one_minus_cos * (2 - m), 1e-30))
    disk = np.stack(((delta * tangent).sum(-1), (delta * bitangent).sum(-1)), -1) / q[..., None]
    rho = (disk * disk).sum(-1)
    square = disk_to_square(disk / np.sqrt(np.maximum(rho, 1))[..., None])
    return square, (rho <= 1) & (m <= AHEAD)


def encode_point(
    point: np.ndarray, sphere: BoundingSphere, r_max: float
) -> tuple[np.ndarray, np.ndarray]:
    r"""Conditioning of the sampler and the fast map on a shading point (Eq. 7).

    :math:`q = e\,(\tfrac12 + \tfrac12 \ln(d/R) / \ln r_{max})` with the unit direction e from the
    centre and the distance d clipped to [R, r_max R]; :math:`t = \tfrac2\pi \arcsin(R/d)`.

    Arguments:
        point: [N, 3] in metres.
        sphere: the bounding sphere.
        r_max: the farthest distance in radii.

    Returns:
        q [N, 3] in [-1, 1], zero at the centre; t [N] in (0, 1].
    """
    offset, distance = _offset(point, sphere)
    ratio = np.clip(distance, 1, r_max)
    s = 0.5 + 0.5 * np.log(ratio) / math.log(r_max)
    q = -offset * (s / np.where(distance > 0, distance, 1))[..., None]
    return q, np.arcsin(1 / ratio) * (2 / math.pi)
