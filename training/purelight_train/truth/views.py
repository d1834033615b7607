"""Pictures of radiance fields through a thin lens, and of lamps by Mitsuba's integrators."""

from __future__ import annotations

import dataclasses
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Radiance, seen
from purelight_train.truth.metrics import Mask
from purelight_train.truth.picture import Passes, Picture
from purelight_train.truth.thin_lens import ThinLens

AZIMUTH_ELEVATION = ((35.0, 10.0), (-85.0, -50.0), (155.0, 40.0))


def three_views(lens: ThinLens) -> list[ThinLens]:
    """From the side, from below and from above, otherwise as `lens`."""
    return [dataclasses.replace(lens, azimuth=a, elevation=e) for a, e in AZIMUTH_ELEVATION]


def field_view(
    surface: ExitSurface, radiance: Radiance, lens: ThinLens, spp: int, rng: np.random.Generator
) -> tuple[Picture, Mask]:
    """Picture of a radiance field on an exit surface, from `spp` rays a pixel (even).

    Returns:
        the picture, and where at least half of a pixel's rays meet the lamp, or any of them if the
        lamp is thinner than that everywhere: [size, size].
    """
    passes, cover = Passes(), np.zeros(lens.size**2)
    for _ in range(spp):
        value, met = seen(surface, radiance, *lens.rays(rng))
        passes.add(value.reshape(lens.size, lens.size, 3).astype(np.float64))
        cover += met
    mask = 2 * cover >= spp
    if not mask.any():
        mask = cover > 0
    return passes.picture(), mask.reshape(lens.size, lens.size)


def path_traced(
    scene: Any, lens: ThinLens, spp: int, seed: int = 0, passes: int = 4, integrator: str = "path"
) -> Picture:
    """Picture of a lamp by a stock integrator.

    Arguments:
        spp: samples per pixel of each pass.
        passes: an even number.
        integrator: `path` (from the camera) or `ptracer` (from the emitters; meets only surfaces
            that are not perfectly smooth).
    """
    camera = mi.load_dict(lens.sensor())
    method = mi.load_dict({"type": integrator, "max_depth": 256, "rr_depth": 256})
    sums = Passes()
    for i in range(passes):
        image = mi.render(scene, sensor=camera, integrator=method, spp=spp, seed=seed + i)
        sums.add(np.array(image).astype(np.float64)[..., :3])
    return sums.picture()
