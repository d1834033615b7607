"""The measures a second time, written from spec/measures.md alone, for `purelight_format` to equal.

Nothing is shared with the reference, neither code nor formulas: where it has quotients and square
roots, here are angles, and the disk map walks along the sides of squares. All in float64.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

POLE = 1e-20  # Axes whose x² + y² is less take the frame of -Z.
Array = np.ndarray


@dataclass(frozen=True)
class Sphere:
    """A bounding sphere: centre [3] and radius in metres."""

    center: tuple[float, float, float]
    radius: float


@dataclass(frozen=True)
class View:
    """A sphere seen from points: axis [N, 3], half of the cap's half-angle, whether outside [N]."""

    axis: Array
    quarter: Array
    outside: Array

    @property
    def one_minus_cos(self) -> Array:
        return 2 * np.sin(self.quarter) ** 2

    @property
    def pdf_solid_angle(self) -> Array:
        """Of directions spread evenly over the cap, 0 at points that are not outside: [N]."""
        return np.where(self.outside, 1 / (4 * math.pi * np.sin(self.quarter) ** 2), 0)


def frame(axis: Array) -> tuple[Array, Array]:
    """Eq. 1: x and y in the mirror that exchanges the axis [N, 3] with -Z."""
    x, y, z = axis.T
    pole = (z < 0) & (x * x + y * y < POLE)
    half, turn = np.arctan2(np.hypot(x, y), z) / 2, np.where(pole, 0, np.arctan2(y, x))
    mirror = np.stack((np.sin(half) * np.cos(turn), np.sin(half) * np.sin(turn), np.cos(half)), 1)
    tangent, bitangent = (np.eye(3)[k] - 2 * mirror[:, k : k + 1] * mirror for k in (0, 1))
    return tangent, bitangent


def square_to_disk(u: Array) -> Array:
    """Eq. 2: the part of a square's outline walked from its right side is that of a circle's."""
    a, b = (2 * u - 1).T
    side = np.maximum(np.abs(a), np.abs(b))
    safe = np.where(side == 0, 1, side)
    walked = np.select(
        (a == side, b == side, a == -side), (b / safe, 2 - a / safe, 4 - b / safe), 6 + a / safe
    )
    return _on_circle(side, walked * math.pi / 4)


def disk_to_square(disk: Array) -> Array:
    """Eq. 3: the same walk back."""
    side, walked = np.hypot(*disk.T), np.arctan2(*disk.T[::-1]) * 4 / math.pi
    return (np.stack((side * _outline(walked), side * _outline(walked - 2)), 1) + 1) / 2


def _on_circle(radius: Array, angle: Array) -> Array:
    return np.stack((radius * np.cos(angle), radius * np.sin(angle)), 1)


def _outline(walked: Array) -> Array:
    """First coordinate of the outline of a square of side 2, 8 round, 0 in the right's middle."""
    return np.clip(2 - np.abs((walked + 4) % 8 - 4), -1, 1)


def cap(point: Array, sphere: Sphere) -> View:
    """Eq. 4: the cone of the half-angle asin(R / d)."""
    offset = np.clip((np.array(sphere.center) - point) / sphere.radius, -1e15, 1e15)
    distance = np.linalg.norm(offset, axis=1)
    axis = np.where(distance[:, None] > 0, offset / np.where(distance, distance, 1)[:, None],
                    [0, 0, 1])  # fmt: skip
    return View(axis, np.arcsin(1 / np.maximum(distance, 1)) / 2, distance > 1 + 1e-6)


def cap_to_direction(u: Array, view: View) -> Array:
    """Eq. 5: chords of half the angle from the axis grow with the radius of the disk."""
    disk = square_to_disk(u)
    away = 2 * np.arcsin(np.hypot(*disk.T) * np.sin(view.quarter))
    aside = _on_circle(np.sin(away), np.arctan2(*disk.T[::-1]))
    return _in_frame(view.axis, aside, np.cos(away))


def _in_frame(axis: Array, aside: Array, ahead: Array) -> Array:
    tangent, bitangent = frame(axis)
    return aside[:, :1] * tangent + aside[:, 1:] * bitangent + ahead[:, None] * axis


def direction_to_cap(toward: Array, view: View) -> tuple[Array, Array]:
    """Eq. 6: the angle from the axis, over that of the rim, by their chords: u [N, 2], inside."""
    tangent, bitangent = frame(view.axis)
    turn = np.arctan2((toward * bitangent).sum(1), (toward * tangent).sum(1))
    away = _angle(toward, view.axis)
    radius = np.sin(away / 2) / np.sin(view.quarter)
    return disk_to_square(_on_circle(np.minimum(radius, 1), turn)), radius <= 1


def _angle(a: Array, b: Array) -> Array:
    """Between vectors [N, 3], exact for small and large ones."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(1))


def area_to_solid_angle(pdf_area: Array, point: Array, position: Array, normal: Array) -> Array:
    """Eq. 8: a patch seen under the angle between its normal and the line to the point: [N]."""
    offset = position - point
    cosine = np.abs(np.cos(_angle(offset, normal)))
    return pdf_area * np.linalg.norm(offset, axis=1) ** 2 / cosine


def encode_point(point: Array, sphere: Sphere, r_max: float) -> tuple[Array, Array]:
    """Eq. 7: q [N, 3] by the logarithm of the distance to the base of r_max, and t [N]."""
    offset = (point - np.array(sphere.center)) / sphere.radius
    distance = np.linalg.norm(offset, axis=1)
    ratio = np.clip(distance, 1, r_max)
    length = (1 + np.emath.logn(r_max, ratio)) / 2
    q = offset * (length / np.where(distance, distance, 1))[:, None]
    return q, 1 - np.arccos(1 / ratio) * 2 / math.pi
