"""Where something hangs, one place a lane."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi


@dataclass
class Frame:
    """A place: world = scale · rotation · local + translation.

    Arguments:
        x, y, z: Rows of the rotation.
    """

    x: mi.Vector3f
    y: mi.Vector3f
    z: mi.Vector3f
    translation: mi.Point3f
    scale: mi.Float

    def direction_to_local(self, d: mi.Vector3f) -> mi.Vector3f:
        return dr.fma(self.x, d.x, dr.fma(self.y, d.y, self.z * d.z))

    def direction_to_world(self, d: mi.Vector3f) -> mi.Vector3f:
        return mi.Vector3f(dr.dot(self.x, d), dr.dot(self.y, d), dr.dot(self.z, d))

    def point_to_local(self, p: mi.Point3f) -> mi.Point3f:
        return mi.Point3f(self.direction_to_local(mi.Vector3f(p - self.translation)) / self.scale)

    def point_to_world(self, p: mi.Point3f) -> mi.Point3f:
        turned = self.direction_to_world(mi.Vector3f(p))
        return mi.Point3f(dr.fma(turned, self.scale, self.translation))
