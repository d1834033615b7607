"""A USD camera as a Mitsuba sensor."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.usd.walk import FURTHEST
from purelight_mitsuba.usd_scene.values import Values, rigid

WIDTH = 960
SAMPLES = 64
TENTHS = 0.1  # Focal length and apertures are in tenths of the stage's unit.


def sensor(
    stage: Any, values: Values, view: str | None, path: Path, note: Callable[[Any, str], None],
    pixel_filter: str,
) -> dict[str, Any]:  # fmt: skip
    """The chosen camera, or the render settings', or the first of the stage.

    Arguments:
        view: Path of the camera's prim, or None.
        path: The stage's file, for errors.
        pixel_filter: Mitsuba's reconstruction filter, which no stage speaks of.

    Raises:
        PureLightError: If there is no such camera.
    """
    from pxr import UsdRender

    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    prim = _choose(stage, settings, view, path)
    wide, high = (values.number(prim, f"{side}Aperture", default)
                  for side, default in (("horizontal", 20.955), ("vertical", 15.2908)))  # fmt: skip
    focal = values.number(prim, "focalLength", 50.0)
    if not all(0 < length < math.inf for length in (focal, wide, high)):
        raise PureLightError(f"{prim.GetPath()}: focal length and apertures must be above 0")
    if not (np.abs(values.to_world(prim)) < FURTHEST).all():
        raise PureLightError(f"{prim.GetPath()}: the camera's place is not finite")
    if str(values.get(prim, "projection", "perspective")) != "perspective":
        note(prim, "orthographic projection is not supported; rendered in perspective")
    film = _film(settings, wide / high, pixel_filter)
    keeps_width, (wide, high) = _conformed(settings, wide, high, film["width"] / film["height"])
    if settings and settings.GetPixelAspectRatioAttr().Get() != 1:
        note(settings.GetPrim(), "pixels that are not square were rendered square")
    near, far = values.get(prim, "clippingRange", (1.0, 1e6))
    result = {
        "type": "perspective",
        "to_world": _to_world(values.to_world(prim)),
        "fov": math.degrees(2 * math.atan((wide if keeps_width else high) / (2 * focal))),
        "fov_axis": "x" if keeps_width else "y",
        "near_clip": max(float(near), 1e-6 * float(far)),
        "far_clip": float(far),
        "principal_point_offset_x": values.number(prim, "horizontalApertureOffset", 0) / wide,
        "principal_point_offset_y": -values.number(prim, "verticalApertureOffset", 0) / high,
        "film": film,
        "sampler": {"type": "independent", "sample_count": SAMPLES},
    }
    stop, distance = (values.number(prim, name, 0.0) for name in ("fStop", "focusDistance"))
    if stop > 0 and distance > 0:
        shift = [result.pop(f"principal_point_offset_{axis}") for axis in "xy"]
        if any(shift):
            note(prim, "a shifted lens is not supported with depth of field; rendered unshifted")
        result["type"] = "thinlens"
        result["aperture_radius"] = TENTHS * focal / (2 * stop)
        result["focus_distance"] = distance
    return result


def _choose(stage: Any, settings: Any, view: str | None, path: Path) -> Any:
    from pxr import UsdGeom

    cameras = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if not cameras:
        raise PureLightError(f"{path}: the stage has no camera; add one")
    names = [str(prim.GetPath()) for prim in cameras]
    if view is None and settings:
        targets = settings.GetCameraRel().GetTargets()
        view = str(targets[0]) if targets else None
    if view is None:
        return cameras[0]
    if view not in names:
        raise PureLightError(f"{path}: no camera {view}; there is {', '.join(names[:8])}")
    return cameras[names.index(view)]


def _to_world(at: np.ndarray) -> Any:
    """A USD camera looks along -Z, Mitsuba's along +Z with +X to the left."""
    turn = np.diag([-1.0, 1.0, -1.0, 1.0])
    return mi.ScalarTransform4f(np.ascontiguousarray(rigid(at) @ turn))


def _conformed(
    settings: Any, wide: float, high: float, aspect: float
) -> tuple[bool, tuple[float, float]]:
    """An aperture of the picture's aspect, by `aspectRatioConformPolicy`: expanded by default.

    Returns:
        Whether its width is kept, and its width and height.
    """
    policy = str(settings.GetAspectRatioConformPolicyAttr().Get()) if settings else ""
    fixed = {"adjustApertureWidth": False, "adjustApertureHeight": True,
             "cropAperture": aspect >= wide / high}  # fmt: skip
    keeps_width = fixed.get(policy, aspect <= wide / high)
    return keeps_width, (wide, wide / aspect) if keeps_width else (high * aspect, high)


def _film(settings: Any, aspect: float, pixel_filter: str) -> dict[str, Any]:
    """A film with the render settings' resolution, or one of 960 pixels' width."""
    width, height = WIDTH, max(round(WIDTH / aspect), 1)
    if settings and settings.GetResolutionAttr().HasAuthoredValue():
        width, height = (int(n) for n in settings.GetResolutionAttr().Get())
    if width < 1 or height < 1:
        raise PureLightError(f"{settings.GetPath()}: the resolution must be at least 1 x 1")
    return {
        "type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": pixel_filter},
        "pixel_format": "rgb", "component_format": "float32",
    }  # fmt: skip
