"""UsdLux lights as Mitsuba emitters, by the formulas of the UsdLux specification."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_mitsuba.usd_scene.shaping import shaping
from purelight_mitsuba.usd_scene.values import Values, rigid, scales, upright

KINDS = (
    "SphereLight", "DiskLight", "RectLight", "CylinderLight", "DistantLight", "DomeLight",
    "DomeLight_1",
)  # fmt: skip
FLAT = ("disk", "rectangle")
AROUND = ("constant", "envmap")
Note = Callable[[Any, str], None]


def light(prim: Any, values: Values, note: Note) -> Iterator[Any]:
    """A light of any kind of `KINDS`, as parts of a scene; none where it gives no light."""
    make = {
        "SphereLight": _sphere,
        "DiskLight": _disk,
        "RectLight": _rectangle,
        "CylinderLight": _cylinder,
        "DistantLight": _distant,
    }.get(str(prim.GetTypeName()), _dome)
    if make in (_distant, _dome) and not shaping(prim, values, note).even:
        note(prim, "only lights that have a shape can be shaped; its shaping was ignored")
    color = strength(prim, values)
    if not np.isfinite(np.asarray(color, np.float32)).all():
        note(prim, "the light is not of finite strength and was left out")
    elif max(color) > 0:
        with np.errstate(all="ignore"):
            part = make(prim, values, note)
        yield from _sized(prim, part, note)


def _sized(prim: Any, part: dict[str, Any], note: Note) -> Iterator[Any]:
    """A light, if it stands somewhere."""
    place = np.array(part["to_world"].matrix, np.float32) if "to_world" in part else np.eye(4)
    if np.isfinite(place).all():
        yield part
    else:
        note(prim, "the light is not of finite size and was left out")


def strength(prim: Any, values: Values) -> list[float]:
    """Radiance before normalisation: intensity * 2^exposure * color, and that of its warmth."""
    from pxr import UsdLux

    color = np.asarray(values.get(prim, "inputs:color", (1, 1, 1)), np.float64)
    if values.get(prim, "inputs:enableColorTemperature", False):
        kelvin = values.number(prim, "inputs:colorTemperature", 6500.0)
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    default = 50_000.0 if str(prim.GetTypeName()) == "DistantLight" else 1.0
    level = values.number(prim, "inputs:intensity", default)
    with np.errstate(all="ignore"):  # Strengths that no number holds are told by `light`
        level *= float(np.exp2(values.number(prim, "inputs:exposure", 0.0)))
        color = np.maximum(color, 0) * level * values.number(prim, "inputs:diffuse", 1.0)
    return [float(value) for value in color]


def _area_light(
    prim: Any, values: Values, note: Note, shape: str, at: np.ndarray, area: float
) -> dict[str, Any]:
    """A shape of Mitsuba's that emits; `normalize` divides by its area."""
    radiance = np.asarray(strength(prim, values))
    if values.get(prim, "inputs:normalize", False):
        radiance = radiance / max(area, 1e-30)
    shaped = shaping(prim, values, note)
    if shape in FLAT and shaped.cone >= 90:
        shaped = replace(shaped, cone=180.0)
    place = {"type": shape, "to_world": mi.ScalarTransform4f(np.ascontiguousarray(at))}
    emitter: Any = {"type": "area", "radiance": _rgb(radiance)}
    if not shaped.even:
        from purelight_mitsuba.usd_scene.shaped_area import ShapedArea  # Needs a variant

        emitter = ShapedArea(radiance, shaped, mi.load_dict(place))
    return place | {"emitter": emitter, "bsdf": {"type": "diffuse", "reflectance": 0.0}}


def _sphere(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    at, radius = values.to_world(prim), values.number(prim, "inputs:radius", 0.5)
    scale = scales(at)
    if np.ptp(scale) > 1e-4 * scale.max():
        note(prim, "a stretched sphere light was rendered as a sphere of its mean radius")
    radius *= float(scale.mean())
    if values.get(prim, "treatAsPoint", False) or radius <= 0:
        note(prim, "a light of no size was rendered as a small sphere of 1 mm")
        radius = 1e-3
    place = upright(at) @ np.diag([radius, radius, radius, 1])
    return _area_light(prim, values, note, "sphere", place, 4 * math.pi * radius**2)


def _disk(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    """A disk emits along -Z; Mitsuba's along +Z."""
    radius = values.number(prim, "inputs:radius", 0.5)
    at = values.to_world(prim) @ np.diag([radius, -radius, -1, 1])
    area = math.pi * float(np.linalg.norm(np.cross(at[:3, 0], at[:3, 1])))
    return _area_light(prim, values, note, "disk", at, area)


def _rectangle(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    """A rectangle emits along -Z; Mitsuba's along +Z, and it reaches from -1 to 1."""
    if values.get(prim, "inputs:texture:file"):
        note(prim, "the light's texture is not supported and was ignored")
    width, height = (values.number(prim, f"inputs:{side}", 1.0) for side in ("width", "height"))
    at = values.to_world(prim) @ np.diag([width / 2, -height / 2, -1, 1])
    area = 4 * float(np.linalg.norm(np.cross(at[:3, 0], at[:3, 1])))
    return _area_light(prim, values, note, "rectangle", at, area)


def _cylinder(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    """A cylinder along X; Mitsuba's is along Z from 0 to 1."""
    at, length = values.to_world(prim), values.number(prim, "inputs:length", 1.0)
    radius = values.number(prim, "inputs:radius", 0.5)
    scale = scales(at)
    if np.ptp(scale) > 1e-4 * scale.max():
        note(prim, "a stretched cylinder light was rendered with its mean scale")
    size = float(scale.mean())
    radius, length = radius * size, length * size
    local = np.array([[0, 0, length, -length / 2], [radius, 0, 0, 0], [0, radius, 0, 0],
                      [0, 0, 0, 1.0]])  # fmt: skip
    area = 2 * math.pi * radius * length
    return _area_light(prim, values, note, "cylinder", upright(at) @ local, area)


def _distant(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    r"""Irradiance of a distant disk: L pi sin^2(angle/2), or L itself where normalised."""
    angle = values.number(prim, "inputs:angle", 0.53)
    if not 0 <= angle <= 360:
        note(prim, "the angle is not within 0 and 360 degrees; taken as 0.53")
        angle = 0.53
    half = math.radians(angle) / 2
    size = math.pi * math.sin(half) ** 2 if half > 0 else 1.0
    normalized = bool(values.get(prim, "inputs:normalize", False))
    irradiance = np.asarray(strength(prim, values)) * (1.0 if normalized else size)
    if half > math.radians(1):
        note(prim, "a wide distant light was rendered with sharp shadows")
    direction = -values.to_world(prim)[:3, 2]
    return {"type": "directional", "direction": direction.tolist(), "irradiance": _rgb(irradiance)}


def _dome(prim: Any, values: Values, note: Note) -> dict[str, Any]:
    """Light from all around: a colour, or a latitude-longitude texture whose pole is +Y."""
    color = strength(prim, values)
    asset = values.get(prim, "inputs:texture:file")
    if not asset or not asset.path:
        return {"type": "constant", "radiance": _rgb(color)}
    how = str(values.get(prim, "inputs:texture:format", "automatic"))
    try:
        image = mi.Bitmap(asset.resolvedPath or asset.path)
    except RuntimeError:
        note(prim, f"texture {asset.path} cannot be read; rendered in the light's colour")
        return {"type": "constant", "radiance": _rgb(color)}
    if how not in ("automatic", "latlong"):
        note(prim, f"texture format {how} is not supported; read as latlong")
    linear = image.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    pixels = np.array(linear) * np.asarray(color, np.float32)
    pole = str(values.get(prim, "poleAxis", "Y"))
    at = rigid(values.to_world(prim))
    if pole == "Z" or (pole == "scene" and _z_up(prim)):
        at = at @ np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(pixels)),
        "to_world": mi.ScalarTransform4f(np.ascontiguousarray(at)),
    }


def together(first: dict[str, Any] | None, second: dict[str, Any]) -> dict[str, Any] | None:
    """One emitter of two of `AROUND`; None for two pictures, which may be turned."""
    if first is None:
        return second
    plain, other = sorted((first, second), key=lambda light: light["type"])
    if plain["type"] == "envmap":
        return None
    color = np.array(plain["radiance"]["value"], np.float32)
    if other["type"] == "constant":
        return plain | {"radiance": _rgb(color + np.array(other["radiance"]["value"]))}
    return other | {"bitmap": mi.Bitmap(np.array(other["bitmap"]) + color)}


def _z_up(prim: Any) -> bool:
    from pxr import UsdGeom

    return bool(UsdGeom.GetStageUpAxis(prim.GetStage()) == UsdGeom.Tokens.z)


def _rgb(value: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in value]}
