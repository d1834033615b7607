"""Rays of a file on the device, one copy however many emitters shine with them."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.files import read_ray_file
from purelight_format.ray_file.rays import Rays

ALIKE, CLASSES = 1.25, 128  # Rays whose powers differ by less than the factor are one class.
Version = tuple[str, str, int, int]


class RaySet:
    """Rays that are drawn in proportion to their power, in their own frame.

    They lie in classes of falling power: a class is drawn, then one of the rays in it, all of which
    are as likely, and differ in their powers by less than `ALIKE`.

    Arguments:
        rays: in metres and W.
    """

    def __init__(self, rays: Rays) -> None:
        self.rays = rays
        share = importance(rays)
        order = np.argsort(-share, kind="stable")
        falling = share[order]
        kind = np.minimum(np.log(falling[0] / falling) / np.log(ALIKE), CLASSES - 1).astype(int)
        bound = np.append(np.unique(kind, return_index=True)[1], len(order))
        sums = np.add.reduceat(falling, bound[:-1])
        self._choice = mi.DiscreteDistribution(mi.Float(sums.astype(np.float32)))
        self._bound = mi.UInt32(bound.astype(np.uint32))
        self._position = mi.Float(rays.position[order].ravel())
        self._direction = mi.Float(rays.direction[order].ravel())
        self._power = mi.Float(rays.power[order].ravel())

    def sample(
        self, sample1: Any, sample2: Any, active: Any
    ) -> tuple[mi.Point3f, mi.Vector3f, mi.Color3f]:
        """Draw rays, [N], by their power.

        Arguments:
            sample1, sample2: [N] in [0, 1).

        Returns:
            starts in metres, unit directions, and power over probability in W per channel.
        """
        kind, probability = self._choice.sample_pmf(mi.Float(sample1), active)
        first = dr.gather(mi.UInt32, self._bound, kind, active)
        count = dr.gather(mi.UInt32, self._bound, kind + 1, active) - first
        index = first + dr.minimum(mi.UInt32(mi.Float(sample2) * mi.Float(count)), count - 1)
        weight = dr.gather(mi.Color3f, self._power, index, active)
        return (
            dr.gather(mi.Point3f, self._position, index, active),
            dr.gather(mi.Vector3f, self._direction, index, active),
            weight * (mi.Float(count) / probability),
        )

    def bounds(self, to_world: mi.Transform4f) -> mi.ScalarBoundingBox3f:
        """The least box with axes of the world, in metres, that holds the starts of all rays."""
        start = to_world @ dr.unravel(mi.Point3f, self._position)
        low, high = (np.array(f(start, axis=1)).ravel() for f in (dr.min, dr.max))
        return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(low), mi.ScalarPoint3f(high))


def importance(rays: Rays) -> NDArray[np.float64]:
    """Mean over the channels of each ray's share of a channel: [N], sums to one."""
    power = rays.power.astype(np.float64)
    total = power.sum(0)
    result: NDArray[np.float64] = (power[:, total > 0] / total[total > 0]).mean(1)
    return result


_lock = threading.Lock()  # Mitsuba loads the objects of a scene in parallel.
_by_file: WeakValueDictionary[Version, RaySet] = WeakValueDictionary()


def load(path: Path) -> RaySet:
    """The rays of a file, for the variant in use; whoever asks while they are in use shares them.

    Raises:
        PureLightError: The file cannot be read, or is no ray file that is known.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise PureLightError(f"{path}: cannot read: {error.strerror}") from error
    version = (mi.variant(), str(path.resolve()), status.st_mtime_ns, status.st_size)
    with _lock:
        found = _by_file.get(version)
        if found is None:
            found = _by_file[version] = RaySet(rays_of(read_ray_file(path)))
        return found
