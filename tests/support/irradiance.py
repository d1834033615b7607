"""Light tracing against path tracing: the mean irradiance that a small lamp casts on a floor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.special import erfcinv

HEIGHT, SIDE = 0.8, 1.6
PASSES, SAMPLES = 16, 1 << 16
FAMILY = 128  # comparisons made by all tests together, three channels each
SIGNIFICANCE = 0.01
FORM_FACTOR = 0.19982  # of unit squares face to face, a side apart (Hottel)


def assert_same_irradiance(mi: Any, parts: dict[str, Any], precision: float = 0.02) -> None:
    """Assert that both means differ by chance only (z-test, Bonferroni over all comparisons).

    Arguments:
        parts: the lamp's shapes about the origin, within half a metre.
        precision: largest standard error of the difference that still says something.
    """
    light, light_error = light_traced(mi, parts)
    path, path_error = path_traced(mi, parts)
    error = np.hypot(light_error, path_error)
    limit = math.sqrt(2) * float(erfcinv(SIGNIFICANCE / FAMILY))
    z = (light - path) / error
    assert (error < precision * path).all(), (light, path, error)
    assert (np.abs(z) < limit).all(), f"ratio {light / path}, z {z}, limit {limit:.2f}"


def light_traced(mi: Any, parts: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Mean irradiance and its standard error, [3] each, in W/m²."""
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.truth.plane import Plane, plane_irradiance

    records = trace_records(mi.load_dict({"type": "scene", **parts}), 1, 0)
    mean, error = plane_irradiance(records, Plane((0, 0, -HEIGHT), SIDE, 1))
    return mean.reshape(3), error.reshape(3)


def path_traced(mi: Any, parts: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """The same by `volpath`, which unlike `path` is right about masks and media."""
    film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"},
            "pixel_format": "rgb", "component_format": "float32"}  # fmt: skip
    floor = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([0, 0, -HEIGHT]).scale(SIDE / 2),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "meter": {"type": "irradiancemeter", "film": film},
    }
    room = mi.load_dict({"type": "scene", **parts, "floor": floor})
    integrator = mi.load_dict({"type": "volpath", "max_depth": 256, "rr_depth": 256})
    passes = [
        np.array(mi.render(room, sensor=0, integrator=integrator, spp=SAMPLES, seed=seed))
        for seed in range(PASSES)
    ]
    stack = np.array(passes, np.float64).reshape(PASSES, 3)
    return stack.mean(0), stack.std(0, ddof=1) / math.sqrt(PASSES)
