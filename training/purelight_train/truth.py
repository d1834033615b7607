"""References that need no network: plane irradiance, path-traced and light-traced pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.geometry import BoundingSphere
from purelight_train.exit_records import ExitRecords

Image = NDArray[np.float64]


@dataclass(frozen=True)
class Plane:
    """A horizontal square that faces up, centred under a lamp.

    Arguments:
        center: [3] in metres.
        side: edge length in metres.
        cells: cells along each edge.
    """

    center: tuple[float, float, float]
    side: float
    cells: int

    @staticmethod
    def below(sphere: BoundingSphere, distance: float = 1.0, side: float = 2.0) -> Plane:
        """The plane `distance` metres below the lamp's centre, 16x16 cells."""
        x, y, z = sphere.center
        return Plane((x, y, z - distance), side, 16)


def plane_irradiance(records: ExitRecords, plane: Plane) -> tuple[Image, Image]:
    """Irradiance of escaped light on a plane, straight from the exit records.

    Returns:
        irradiance and its standard error in W/m² per channel, two of [cells, cells, 3] indexed
        by [y, x].
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (plane.center[2] - records.position[:, 2]) / records.direction[:, 2]
        at = records.position + t[:, None] * records.direction - np.asarray(plane.center)
    unit = at[:, :2] / plane.side + 0.5
    hit = (t > 0) & (unit >= 0).all(1) & (unit < 1).all(1)
    cell = np.floor(unit[hit] * plane.cells).astype(np.int64)
    index = cell[:, 1] * plane.cells + cell[:, 0]
    weight = records.weight[hit].astype(np.float64) / (plane.side / plane.cells) ** 2
    sums = [
        np.stack([np.bincount(index, w[:, c], plane.cells**2) for c in range(3)], 1)
        for w in (weight, weight**2)
    ]
    mean = sums[0] / records.paths
    error = np.sqrt(np.maximum(sums[1] / records.paths - mean**2, 0) / records.paths)
    shape = (plane.cells, plane.cells, 3)
    return mean.reshape(shape), error.reshape(shape)


def view_sensor(
    sphere: BoundingSphere, size: int, azimuth: float, elevation: float, distance: float = 4.0
) -> dict[str, Any]:
    """The pinhole camera of `preview.view_rays` as a Mitsuba sensor."""
    a, e = np.radians((azimuth, elevation))
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    centre = np.asarray(sphere.center)
    half = 1.05 / math.sqrt(distance**2 - 1)
    up = [0, 0, 1] if abs(back[2]) < 0.999 else [-np.cos(a), -np.sin(a), 0]
    return {
        "type": "perspective",
        "fov": math.degrees(2 * math.atan(half)),
        "near_clip": sphere.radius * 1e-2,
        "far_clip": sphere.radius * 1e3,
        "to_world": mi.ScalarTransform4f().look_at(
            list(centre + distance * sphere.radius * back), list(centre), up
        ),
        "film": {
            "type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
            "pixel_format": "rgb", "component_format": "float32",
        },
    }  # fmt: skip


def render_view(
    scene: Any, sensor: dict[str, Any], integrator: str, spp: int, seed: int = 0, passes: int = 1
) -> tuple[Image, Image]:
    """Picture of a lamp by a stock integrator, and its standard error from independent passes.

    Arguments:
        integrator: `path` (from the camera) or `ptracer` (from the emitters; meets only
            surfaces that are not perfectly smooth).
        spp: samples per pixel of each pass.

    Returns:
        two of [size, size, 3]; the error is NaN for a single pass.
    """
    camera = mi.load_dict(sensor)
    method = mi.load_dict({"type": integrator, "max_depth": 64, "rr_depth": 16})
    images = [
        np.array(mi.render(scene, sensor=camera, integrator=method, spp=spp, seed=seed + i))
        for i in range(passes)
    ]
    stack = np.stack(images).astype(np.float64)[..., :3]
    if passes == 1:
        return stack[0], np.full(stack[0].shape, np.nan)
    return stack.mean(0), stack.std(0, ddof=1) / math.sqrt(passes)


def mape(image: Image, reference: Image, mask: NDArray[np.bool_] | None = None) -> float:
    """Mean of |I - R| / (R + 0.01 mean R) over the pixels of the mask, or over all."""
    chosen = np.ones(image.shape[:2], bool) if mask is None else mask
    floor = 0.01 * reference[chosen].mean()
    return float(np.mean(np.abs(image - reference)[chosen] / (reference[chosen] + floor)))


def relative_mse(image: Image, reference: Image, mask: NDArray[np.bool_] | None = None) -> float:
    """Mean of (I - R)² / (R² + (0.1 mean R)²) over the pixels of the mask, or over all."""
    chosen = np.ones(image.shape[:2], bool) if mask is None else mask
    floor = (0.1 * reference[chosen].mean()) ** 2
    square = (image - reference)[chosen] ** 2
    return float(np.mean(square / (reference[chosen] ** 2 + floor)))
