"""The luminaires of a USD stage."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.usd.walk import Shown, Walk, stand_ins
from purelight_format.usd_schema import SCHEMA


@dataclass(frozen=True)
class LuminairePrim:
    """A luminaire on a USD stage.

    Arguments:
        path: of the prim; that of the prototype for instances of a point instancer.
        bundle: resolved path of the bundle.
        digest: SHA-256 of its manifest.json, empty if none is given.
        to_world: [4, 4] matrix for column vectors, in stage units.
        dimmer: factor on the emission.
        fallback: paths of the lights that stand in for the luminaire elsewhere.
        exit_surface: paths of the meshes that show its exit surface.
    """

    path: str
    bundle: str
    digest: str
    to_world: np.ndarray
    dimmer: float
    fallback: tuple[str, ...]
    exit_surface: tuple[str, ...]


def luminaires(stage: Any, time: Any = None) -> list[LuminairePrim]:
    """Finds the luminaires of an open `Usd.Stage` that are shown, one for each instance.

    Arguments:
        time: A `Usd.TimeCode`; the default values if None.

    Raises:
        PureLightError: If there are more instances than a scene may have.
    """
    from pxr import Usd

    time = Usd.TimeCode.Default() if time is None else time
    return [lamp for shown in Walk(stage, time) for lamp in luminaires_of(shown, time)]


def luminaires_of(shown: Shown, time: Any) -> Iterator[LuminairePrim]:
    """The luminaire that a prim is, once for each place of it; none if it is another thing.

    Whether or not the schema is registered: the applied schemas of the type info tell.
    """
    prim = shown.prim
    if SCHEMA not in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
        return

    def value(name: str, default: Any) -> Any:
        found = prim.GetAttribute(f"purelight:{name}").Get(time)
        return default if found is None else found

    bundle = value("bundle", None)
    for matrix in shown.to_world():
        yield LuminairePrim(
            path=str(prim.GetPath()),
            bundle=(bundle.resolvedPath or bundle.path) if bundle else "",
            digest=value("bundleDigest", ""),
            to_world=matrix,
            dimmer=float(value("dimmer", 1.0)),
            fallback=stand_ins(prim, "fallback"),
            exit_surface=stand_ins(prim, "exitSurface"),
        )
