"""Transmittance from part of the way: viewers and objects between the parts of a lamp."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from tests.support import analytic_lamps as lamps

T = mi.ScalarTransform4f
THROUGH = 0.5
X, Y, Z = lamps.CENTRE  # the panes stand a tenth of a metre to either side of X


def facing(offset: float, content: dict[str, Any]) -> dict[str, Any]:
    """A square across the x axis that faces +X."""
    turned = T().translate([X + offset, Y, Z]).rotate([0, 1, 0], 90).scale(0.12)
    return {"type": "rectangle", "to_world": turned, **content}


def picture(tmp_path: Path, eye: float, parts: dict[str, Any], engine: str = "fused") -> np.ndarray:
    """Mean radiance that a viewer at `eye` metres from the centre sees along -X."""
    bundle = lamps.two_panes(THROUGH).write(tmp_path / "panes.plux")
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}}
    look = lamps.look_at([X + eye, Y, Z], [X - 3, Y, Z])
    scene = mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 1, "to_world": look, "film": film},
        "lamp": {"type": "purelight", "filename": str(bundle)},
        **parts,
    })  # fmt: skip
    integrator = mi.load_dict({"type": "purelight", "engine": engine, "max_depth": 2})
    return np.array(mi.render(scene, integrator=integrator, spp=64)).mean((0, 1))[:3]


@pytest.mark.parametrize(
    ("eye", "patch", "panes"),
    [(2, -2, 2), (2, 0, 1), (0.02, -2, 1), (0.05, -0.05, 0), (2, 0.15, 0), (0.15, 0, 1)],
)
def test_a_view_passes_the_panes_on_its_way(
    tmp_path: Path, eye: float, patch: float, panes: int
) -> None:
    light = {"type": "area", "radiance": {"type": "rgb", "value": [3.0, 2.0, 1.0]}}
    size = {"patch": facing(patch, {"emitter": light})}
    seen = picture(tmp_path, eye, size)
    np.testing.assert_allclose(seen, THROUGH**panes * np.array([3, 2, 1]), rtol=1e-4)


@pytest.mark.parametrize(("patch", "panes"), [(0, 1), (-0.2, 2), (0.15, 0)])
def test_a_shadow_ray_passes_the_panes_on_its_way(tmp_path: Path, patch: float, panes: int) -> None:
    """A matt square between the panes, lit from far away, as the viewer just before it sees it."""
    matt = {"bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}}
    sun = {"type": "directional", "direction": [-1, 0, 0], "irradiance": 2.0}
    seen = picture(tmp_path, patch + 0.03, {"patch": facing(patch, matt), "sun": sun})
    np.testing.assert_allclose(seen, THROUGH**panes / np.pi, rtol=1e-4)


def test_both_ends_inside_the_sphere(tmp_path: Path) -> None:
    """A viewer and an object inside the sphere, both panes between them and none beyond: exact."""
    light = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    seen = picture(tmp_path, 0.13, {"patch": facing(-0.13, {"emitter": light})})
    np.testing.assert_allclose(seen, THROUGH**2, rtol=1e-4)
