"""Transmittance from part of the way: viewers and objects between the parts of a lamp."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_export.graph import Graph
from tests.support import analytic_lamps as lamps

T = mi.ScalarTransform4f
THROUGH = 0.5
X, Y, Z = lamps.CENTRE  # the panes stand a tenth of a metre to either side of X


def facing(offset: float, content: dict[str, Any]) -> dict[str, Any]:
    """A square across the x axis that faces +X."""
    turned = T().translate([X + offset, Y, Z]).rotate([0, 1, 0], 90).scale(0.12)
    return {"type": "rectangle", "to_world": turned, **content}


def picture(
    tmp_path: Path, eye: float, parts: dict[str, Any], engine: str = "fused", *, spp: int = 64,
    lamp: lamps.Lamp | None = None,
) -> np.ndarray:  # fmt: skip
    """Mean radiance that a viewer at `eye` metres from the centre sees along -X."""
    bundle = (lamp or lamps.two_panes(THROUGH)).write(tmp_path / "panes.plux")
    film = {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}}
    look = lamps.look_at([X + eye, Y, Z], [X - 3, Y, Z])
    scene = mi.load_dict({
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 1, "to_world": look, "film": film},
        "lamp": {"type": "purelight", "filename": str(bundle)},
        **parts,
    })  # fmt: skip
    integrator = mi.load_dict({"type": "purelight", "engine": engine, "max_depth": 3})
    return np.array(mi.render(scene, integrator=integrator, spp=spp)).mean((0, 1))[:3]


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


def ball_between(tmp_path: Path) -> dict[str, Any]:
    """A lamp between the panes, a quarter as large as they are apart."""
    bundle = lamps.ball().write(tmp_path / "ball.plux")
    placed = T().translate([X, Y, Z]).scale(0.2) @ T().translate([-X, -Y, -Z])
    return {"ball": {"type": "purelight", "filename": str(bundle), "to_world": placed}}


@pytest.mark.parametrize("engine", ["fused", "queued"])
def test_a_lamp_between_the_parts_of_another_is_behind_some_of_them(
    engine: str, tmp_path: Path
) -> None:
    """Seen, lighting a square outside, and before what is seen behind both."""
    light = {"type": "area", "radiance": {"type": "rgb", "value": [3.0, 2.0, 1.0]}}
    twin = {"ball": {"type": "sphere", "center": [X, Y, Z], "radius": 0.25 * 0.2}}
    ball = ball_between(tmp_path)
    np.testing.assert_allclose(
        picture(tmp_path, 2, ball, engine), THROUGH * lamps.COLOUR, rtol=2e-3
    )
    matt = {"bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}}
    floor = {"floor": facing(-0.6, matt)}
    lit, by_twin = (
        picture(tmp_path, -0.5, floor | parts, engine, spp=4096)
        for parts in (ball, {"ball": twin["ball"] | {"emitter": light}})
    )
    np.testing.assert_allclose(lit / lamps.COLOUR, by_twin / [3, 2, 1], rtol=0.02)
    beyond = {"patch": facing(-2, {"emitter": light})}
    seen = picture(tmp_path, 2, beyond | glass_between(tmp_path), engine)
    np.testing.assert_allclose(seen, THROUGH**2 * 0.25 * np.array([3, 2, 1]), rtol=1e-3)


def glass_between(tmp_path: Path) -> dict[str, Any]:
    """A dark sheet between the panes that lets a quarter through."""
    bundle = lamps.glass_sheet([0.25] * 3).write(tmp_path / "sheet.plux")
    turned = T().translate([X, Y, Z]).rotate([0, 1, 0], 90).scale(0.3)
    placed = turned @ T().translate([-X, -Y, -Z])
    return {"sheet": {"type": "purelight", "filename": str(bundle), "to_world": placed}}


@pytest.mark.parametrize("bsdf", ["null", "mask", "thindielectric"])
@pytest.mark.parametrize("offset", [0.15, 0.0, -0.15])
def test_light_counts_once_though_a_line_is_cut_by_what_nobody_sees(
    offset: float, bsdf: str, tmp_path: Path
) -> None:
    """The panes' rear one shines, and is part of what the front one shows."""
    shining = lamps.two_panes(1.0)
    graph = Graph("appearance")
    position, _, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    ahead = graph.relu(graph.sign(graph.slice(outgoing, 0, 1)))
    graph.output("radiance", position * 0.0 + ahead * lamps.COLOUR)
    networks = shining.networks | {"appearance": graph.to_bytes()}
    flux = np.zeros((4, 3), np.float32)
    flux[2:] = lamps.COLOUR
    lamp = replace(shining, networks=networks, flux=2 * np.array(lamps.COLOUR),
                   surface=replace(shining.surface, triangle_flux=flux))  # fmt: skip
    unseen = {
        "null": {"type": "null"},
        "mask": {"type": "mask", "opacity": 0.0, "bsdf": {"type": "diffuse"}},
        "thindielectric": {"type": "thindielectric", "int_ior": 1.0, "ext_ior": 1.0},
    }
    between = {"unseen": facing(offset, {"bsdf": unseen[bsdf]})}
    seen = picture(tmp_path, 2, between, lamp=lamp)
    np.testing.assert_allclose(seen, lamps.COLOUR, rtol=1e-4)
