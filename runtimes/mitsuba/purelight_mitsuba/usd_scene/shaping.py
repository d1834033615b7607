"""The `ShapingAPI` of a light: cone, focus and IES profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.reader import read_ies
from purelight_mitsuba.sampling.far_field import integral, on_grid
from purelight_mitsuba.usd_scene.values import Values, rigid

LARGEST_IES = 4 << 20  # Bytes.
HEMISPHERE = 95.0  # Degrees; a profile of no larger span counts as one half of space.


@dataclass(frozen=True)
class Shaping:
    """The factors on a light's radiance, by the formulas of UsdLux.

    Arguments:
        to_local: [3, 3] from the world into the light's frame, whose axis is -Z.
        focus: Power of the cosine to the axis.
        tint: [3] what is left where focus takes all.
        cone: Half-angle of the light in degrees; 180 or more for no limit.
        softness: Part of the cone within which the light fades.
        profile: [HORIZONTAL, VERTICAL] on the grid of `far_field`, or None.
        angle_scale: Of the profile's vertical angles.
    """

    to_local: np.ndarray = field(default_factory=lambda: np.eye(3))
    focus: float = 0.0
    tint: np.ndarray = field(default_factory=lambda: np.zeros(3))
    cone: float = 180.0
    softness: float = 0.0
    profile: np.ndarray | None = None
    angle_scale: float = 0.0

    @property
    def even(self) -> bool:
        """Whether there is nothing to do."""
        return self.focus <= 0 and self.cone >= 180 and self.profile is None


def shaping(prim: Any, values: Values, note: Callable[[Any, str], None]) -> Shaping:
    """What shapes a light's radiance; attributes count only where the API is applied.

    Arguments:
        note: Is told of a profile that cannot be used.
    """
    if "ShapingAPI" not in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
        return Shaping()

    def number(name: str, default: float) -> float:
        return values.number(prim, f"inputs:shaping:{name}", default)

    cone = number("cone:angle", 90.0) if _stated(prim, "cone:angle") else 180.0
    tint = values.get(prim, "inputs:shaping:focusTint", (0, 0, 0))
    return Shaping(
        to_local=rigid(values.to_world(prim))[:3, :3].T,
        focus=max(number("focus", 0.0), 0.0),
        tint=np.maximum(np.asarray(tint, np.float64), 0),
        cone=max(cone, 0.0),
        softness=float(np.clip(number("cone:softness", 0.0), 0, 1)),
        profile=_profile(prim, values, note),
        angle_scale=number("ies:angleScale", 0.0),
    )


def _stated(prim: Any, name: str) -> bool:
    attribute = prim.GetAttribute(f"inputs:shaping:{name}")
    return bool(attribute) and attribute.HasAuthoredValue()


def _profile(prim: Any, values: Values, note: Callable[[Any, str], None]) -> np.ndarray | None:
    """The IES file's intensities; relative to their mean where they are to be normalised."""
    asset = values.get(prim, "inputs:shaping:ies:file")
    if asset is None or not asset.path:
        return None
    path = Path(asset.resolvedPath or asset.path)
    try:
        if path.stat().st_size > LARGEST_IES:
            raise PureLightError(f"{path.name}: larger than {LARGEST_IES:,} bytes")
        table = read_ies(path.read_bytes(), path.name)
    except (OSError, PureLightError) as error:
        note(prim, f"its IES profile cannot be used ({error}) and was ignored")
        return None
    grid = on_grid(table)
    if not np.isfinite(grid).all() or grid.min() < 0 or not grid.max() > 0:
        note(prim, f"its IES profile {path.name} has no light and was ignored")
        return None
    if not values.get(prim, "inputs:shaping:ies:normalize", False):
        return grid
    half = np.ptp(table.vertical) <= HEMISPHERE
    return grid * ((2 if half else 4) * np.pi / integral(grid))
