"""The cap of directions in which a lamp's bounding sphere is seen, in Dr.Jit.

Eqs. 1, 4 and 5 of spec/measures.md, independent of `purelight_format.measures` on purpose: a
mistake in either shows where they are compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

INSIDE = 1 + 1e-6  # Points nearer than this many radii see no cap.


@dataclass
class Cap:
    """A cap per lane.

    Arguments:
        axis: Unit direction to the centre, +Z at the centre itself.
        one_minus_cos: Of the half-angle.
        outside: Whether the point is outside the sphere; otherwise there is no cap.
    """

    axis: mi.Vector3f
    one_minus_cos: mi.Float
    outside: mi.Bool

    def pdf_solid_angle(self) -> mi.Float:
        """The uniform density on the cap, zero where there is none."""
        return dr.select(self.outside, dr.inv_two_pi / self.one_minus_cos, 0)

    def direction(self, u: mi.Point2f) -> mi.Vector3f:
        """Equal-area map of the unit square onto the cap."""
        x, y, z = frame(self.axis)
        disk = mi.warp.square_to_uniform_disk_concentric(u)
        m = dr.squared_norm(disk) * self.one_minus_cos
        q = dr.sqrt(self.one_minus_cos * (2 - m))
        return z * (1 - m) + (x * disk.x + y * disk.y) * q


def cap(point: mi.Point3f, centre: mi.Point3f, radius: mi.Float) -> Cap:
    """Returns the cap that a sphere covers, seen from points in the same frame."""
    offset = mi.Vector3f(centre - point)
    distance = dr.norm(offset)
    outside = distance > radius * INSIDE
    square = dr.square(radius / dr.maximum(distance, radius))
    axis = dr.select(distance > 0, offset / distance, mi.Vector3f(0, 0, 1))
    return Cap(axis, square / (1 + dr.sqrt(1 - square)), outside)


def frame(n: mi.Vector3f) -> tuple[mi.Vector3f, mi.Vector3f, mi.Vector3f]:
    """Tangent, bitangent and the unit axis itself, right-handed, singular only at -Z."""
    rho = dr.square(n.x) + dr.square(n.y)
    pole = (n.z < 0) & (rho < 1e-20)
    k = dr.select(n.z >= 0, 1 / (1 + n.z), (1 - n.z) / dr.maximum(rho, 1e-20))
    xx = dr.select(pole, 2, k * n.x * n.x)
    xy = dr.select(pole, 0, k * n.x * n.y)
    yy = dr.select(pole, 0, k * n.y * n.y)
    return mi.Vector3f(1 - xx, -xy, -n.x), mi.Vector3f(-xy, 1 - yy, -n.y), n
