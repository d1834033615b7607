"""Surroundings for an enlarged lamp: a closed room, the sun, a patch; and noise of pictures."""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere
from purelight_train.truth.picture import Passes, Picture

ROOM = 5.0  # half the side of the room, in radii of the lamp
GREY = 0.6
PATCH_ALBEDO = 0.02  # so little that the lamp does not see the patch
Objects = dict[str, Any]
Vector = NDArray[np.float64]


def film(width: int, height: int) -> Objects:
    """A film of pixels that share no light."""
    return {
        "type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
        "pixel_format": "rgb", "component_format": "float32",
    }  # fmt: skip


def passes(
    objects: Objects, integrator: Objects, spp: int, count: int = 8, goal: float = 0.0
) -> Picture:
    """A picture as the mean of independent renderings.

    Arguments:
        spp: of all together.
        goal: relative standard error of the whole picture's mean that ends it early, and so does a
            picture that is black after eight.
    """
    scene = mi.load_dict({"type": "scene", "integrator": integrator, **objects})
    sums = Passes()
    for seed in range(count):
        image = mi.render(scene, spp=max(spp // count, 1), seed=seed + 1)
        sums.add(np.array(image, np.float64)[..., :3])
        if goal > 0 and sums.count % 8 == 0 and noise(sums.picture()) <= goal:
            break
    return sums.picture()


def noise(picture: Picture) -> float:
    """Standard error of a picture's mean over that mean; zero for a black picture."""
    level = float(picture.image.mean())
    error = float(np.sqrt((picture.error**2).sum())) / picture.error.size
    return error / level if level > 0 else 0.0


def room(sphere: BoundingSphere, size: int) -> Objects:
    """A closed matt room about the lamp's sphere, a block in it, and a camera in a corner."""
    centre, half = np.asarray(sphere.center), ROOM * sphere.radius
    T = mi.ScalarTransform4f
    walls = T().translate(list(centre)).scale(half)
    block = T().translate(list(centre + half * np.array([0.5, 0.4, -0.7]))).scale(0.22 * half)
    eye = centre + half * np.array([-0.92, -0.9, 0.1])
    target = centre + half * np.array([0.35, 0.3, -0.45])
    return {
        "walls": {"type": "cube", "to_world": walls, "flip_normals": True, "bsdf": _matt(GREY)},
        "block": {"type": "cube", "to_world": block, "bsdf": _matt(0.4)},
        "sensor": {
            "type": "perspective", "fov": 80.0, "film": film(size, size),
            "to_world": T().look_at(list(eye), list(target), [0, 0, 1]),
            "near_clip": 1e-3 * half, "far_clip": 1e2 * half,
        },
    }  # fmt: skip


def sun() -> Objects:
    """Parallel light from the zenith, an irradiance of one."""
    return {"sun": {"type": "directional", "direction": [0, 0, -1], "irradiance": 1.0}}


def patch(at: Vector, normal: Vector, half: float) -> Objects:
    """A small dark square about a point, and a camera just above it that sees nothing else."""
    bsdf = _matt(PATCH_ALBEDO)
    return {"patch": _square(at, normal, half) | {"bsdf": bsdf}, "sensor": _above(at, normal, half)}


def pane(at: Vector, normal: Vector, half: float) -> Objects:
    """The same, as bright on its side, which lets through what it does not send back.

    Between the parts of a lamp a dark square would shadow one from the other, as a body of the room
    does; what a bundle knows is the lamp without it. For a light tracer: a camera ray goes through.
    """
    bsdf = {"type": "mask", "opacity": PATCH_ALBEDO, "nested": _matt(1.0)}
    return {"patch": _square(at, normal, half) | {"bsdf": bsdf}, "sensor": _above(at, normal, half)}


def meter(at: Vector, normal: Vector, half: float) -> Objects:
    """A square that is not there for light, and measures irradiance: for a path tracer."""
    sensor = {"type": "irradiancemeter", "film": film(2, 2)}
    return {"patch": _square(at, normal, half) | {"bsdf": {"type": "null"}, "sensor": sensor}}


def of_patch(picture: Picture) -> Picture:
    """Irradiance in W/m² of a picture of `patch` or `pane`."""
    return picture.scaled(math.pi / PATCH_ALBEDO)


def _square(at: Vector, normal: Vector, half: float) -> Objects:
    up = np.eye(3)[np.argmin(np.abs(normal))]
    place = mi.ScalarTransform4f().look_at(list(at), list(at + normal), list(up)).scale(half)
    return {"type": "rectangle", "to_world": place}


def _above(at: Vector, normal: Vector, half: float) -> Objects:
    """A camera whose picture a square fills."""
    eye, up = at + 0.5 * half * normal, np.eye(3)[np.argmin(np.abs(normal))]
    return {
        "type": "perspective", "fov": math.degrees(2 * math.atan(2.0)), "film": film(2, 2),
        "to_world": mi.ScalarTransform4f().look_at(list(eye), list(at), list(up)),
        "near_clip": 1e-2 * half, "far_clip": 1e2 * half,
    }  # fmt: skip


def _matt(grey: float) -> Objects:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": grey}}
