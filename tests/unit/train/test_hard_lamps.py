"""Hard lamps (light and surface): any size and power, traps, broken meshes, values not finite."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from purelight_format.errors import PureLightError

BLACK = {"type": "diffuse", "reflectance": 0.0}


def lamp_of_size(mi: Any, size: float, radiance: float = 1.0) -> Any:
    """A bulb in a thin glass globe, all lengths times `size`: walls of a fiftieth of it."""
    glass = {"type": "dielectric", "int_ior": 1.5}
    return mi.load_dict(
        {
            "type": "scene",
            "bulb": {
                "type": "sphere", "radius": 0.2 * size, "bsdf": BLACK,
                "emitter": {"type": "area", "radiance": radiance},
            },
            "mirror": {
                "type": "sphere", "radius": 0.21 * size, "center": [0, 0, 0.45 * size],
                "bsdf": {"type": "conductor", "material": "Al"},
            },
            "outside": {"type": "sphere", "radius": size, "bsdf": glass},
            "inside": {
                "type": "sphere", "radius": 0.98 * size, "flip_normals": True, "bsdf": glass,
            },
        }
    )  # fmt: skip


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_size_does_not_matter(mitsuba: Any, size: float) -> None:
    """The same paths, scaled: Mitsuba's own `spawn_ray` loses a quarter of a centimetre lamp."""
    from purelight_train.light.light_tracing import trace_records

    unit = trace_records(lamp_of_size(mitsuba, 1.0), 1, 0)
    scaled = trace_records(lamp_of_size(mitsuba, size), 1, 0)
    error = np.hypot(unit.flux_error, scaled.flux_error / size**2)
    assert (np.abs(scaled.flux / size**2 - unit.flux) < 4 * error).all()
    assert len(scaled) == pytest.approx(len(unit), rel=2e-3)
    assert scaled.dropped == 0


@pytest.mark.parametrize("power", [1e-6, 1e6])
def test_power_does_not_matter(mitsuba: Any, power: float) -> None:
    from purelight_train.light.light_tracing import trace_records

    unit = trace_records(lamp_of_size(mitsuba, 1.0), 1, 0)
    scaled = trace_records(lamp_of_size(mitsuba, 1.0, power), 1, 0)
    np.testing.assert_array_equal(scaled.position, unit.position)
    np.testing.assert_allclose(scaled.weight, power * unit.weight, rtol=1e-5)


def test_red_only_lamp_behind_coloured_glass(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    red = {"type": "rgb", "value": [5.0, 0, 0]}
    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "bulb": {"type": "sphere", "radius": 0.1, "emitter": {"type": "area", "radiance": red}},
            "globe": {"type": "sphere", "bsdf": {"type": "thindielectric"}},
        }
    )
    records = trace_records(scene, 1, 0)
    assert records.channels == (True, False, False)
    assert (records.weight[:, 1:] == 0).all()


def test_total_reflection_trap_ends(mitsuba: Any) -> None:
    """Light that starts near the rim of a glass ball is trapped: paths end, are counted, and
    what escapes never weighs more than what was emitted."""
    from purelight_train.light.light_tracing import trace_records

    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "bulb": {
                "type": "sphere", "radius": 0.02, "center": [0.9, 0, 0], "bsdf": BLACK,
                "emitter": {"type": "area", "radiance": 1.0},
            },
            "ball": {"type": "sphere", "bsdf": {"type": "dielectric", "int_ior": 1.8}},
        }
    )  # fmt: skip
    with pytest.warns(UserWarning, match="traps light"):
        records = trace_records(scene, 1, 0)
    assert 1e-3 < records.cut / records.paths < 0.5
    assert records.weight.max() <= 1.0001 * 4 * math.pi**2 * 0.02**2


def test_not_finite_paths_are_dropped_counted_and_told(mitsuba: Any) -> None:
    """A texture with one NaN: its light is left out, the rest is as it was."""
    from purelight_train.light.light_tracing import trace_records

    picture = np.ones((4, 4, 3), np.float32)
    picture[1, 2] = np.nan
    reflectance = {
        "type": "bitmap", "bitmap": mitsuba.Bitmap(picture), "raw": True, "filter_type": "nearest",
    }  # fmt: skip
    panel = mitsuba.ScalarTransform4f().translate([0, 0, -0.5])
    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "bulb": {
                "type": "sphere", "radius": 0.1, "bsdf": BLACK,
                "emitter": {"type": "area", "radiance": 1.0},
            },
            "panel": {
                "type": "rectangle", "to_world": panel,
                "bsdf": {"type": "diffuse", "reflectance": reflectance},
            },
        }
    )  # fmt: skip
    with pytest.warns(UserWarning, match=r"light paths dropped: not finite"):
        records = trace_records(scene, 1, 0)
    assert 0.001 < records.dropped / records.paths < 0.2
    assert np.isfinite(records.weight).all()
    assert len(records) + records.dropped <= records.paths


@pytest.mark.parametrize("change", ["flipped", "open"])
def test_flipped_and_open_globes_give_finite_records(mitsuba: Any, change: str) -> None:
    """Wrong glass is refracted wrongly, but nothing breaks and no power appears."""
    import trimesh

    from purelight_train.light.exit_records import settle
    from purelight_train.light.exit_surface import mitsuba_mesh
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.visible_part import visible_part

    globe = trimesh.creation.icosphere(3)
    faces = globe.faces[:, ::-1] if change == "flipped" else globe.faces[: len(globe.faces) // 2]
    mesh = mitsuba_mesh(np.asarray(globe.vertices), np.asarray(faces))
    mesh.set_bsdf(mitsuba.load_dict({"type": "dielectric", "int_ior": 1.5}))
    bulb = {
        "type": "sphere", "radius": 0.2, "bsdf": BLACK,
        "emitter": {"type": "area", "radiance": 1.0},
    }  # fmt: skip
    scene = mitsuba.load_dict({"type": "scene", "bulb": bulb, "globe": mesh})
    records = trace_records(scene, 1, 0)
    assert records.dropped == 0
    assert records.flux[0] <= 4 * math.pi**2 * 0.2**2 * 1.0001
    surface = visible_part(*scene_triangles(scene), 1 << 16, np.random.default_rng(0))
    settled, triangle = settle(records, surface)
    assert np.isfinite(settled.normal).all()
    assert (triangle >= 0).mean() > 0.99


def test_lamp_file_with_glass_inside_out_is_warned_of(mitsuba: Any, tmp_path: Path) -> None:
    from purelight_train.light.luminaire import load_luminaire

    text = """<scene version="3.0.0">
      <shape type="sphere"><float name="radius" value="0.2"/>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>
      <shape type="sphere" id="globe"><boolean name="flip_normals" value="{flip}"/>
        <bsdf type="dielectric"/></shape></scene>"""
    path = tmp_path / "lamp.xml"
    path.write_text(text.format(flip="true"))
    with pytest.warns(UserWarning, match=r"'globe'.*inside out"):
        load_luminaire(path)
    path.write_text(text.format(flip="false"))
    load_luminaire(path)


@pytest.mark.parametrize(("glass", "refused"), [("dielectric", True), ("roughdielectric", False)])
def test_rays_without_radiance_are_refused(
    mitsuba: Any, tmp_path: Path, glass: str, refused: bool
) -> None:
    """A point light in clear glass sends out rays; in rough glass its light has a radiance."""
    from purelight_train.presets import DRAFT
    from purelight_train.runs.pipeline import start

    scene = tmp_path / "lamp.xml"
    scene.write_text(f"""<scene version="3.0.0">
      <emitter type="point"><rgb name="intensity" value="1"/></emitter>
      <shape type="sphere"><bsdf type="{glass}"/></shape></scene>""")
    run = tmp_path / "run"
    if refused:
        with pytest.raises(PureLightError, match=r"100 % .* without area"):
            start(scene, run, DRAFT, 0, "cpu", resume=False, route="photons")
        assert not run.exists()
    else:
        start(scene, run, DRAFT, 0, "cpu", resume=False, route="photons")


@pytest.mark.parametrize(("shape", "triangles"), [("rectangle", 2), ("cube", 12), ("disk", None)])
def test_flat_shapes_by_formula_load_without_a_warning(
    mitsuba: Any, tmp_path: Path, shape: str, triangles: int | None
) -> None:
    """Mitsuba's rectangle says that it is a mesh and has normals, but shows no triangles."""
    from purelight_train.light.luminaire import load_luminaire

    emitter = '<emitter type="area"><rgb name="radiance" value="1"/></emitter>'
    path = tmp_path / "lamp.xml"
    path.write_text(f'<scene version="3.0.0"><shape type="{shape}">{emitter}</shape></scene>')
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface = load_luminaire(path).exit_surface
    assert triangles is None or len(surface.triangles) == triangles


def test_smooth_emitters_are_warned_of(mitsuba: Any, tmp_path: Path) -> None:
    from purelight_train.light.luminaire import load_luminaire

    trimesh.creation.icosphere(subdivisions=2).export(tmp_path / "ball.ply")
    path = tmp_path / "lamp.xml"
    path.write_text(
        '<scene version="3.0.0"><shape type="ply"><string name="filename" value="ball.ply"/>'
        '<emitter type="area"><rgb name="radiance" value="1"/></emitter></shape></scene>'
    )
    with pytest.warns(UserWarning, match="smooth normals"):
        load_luminaire(path)


@pytest.mark.parametrize("stray", [1e7, math.nan])
def test_vertices_of_no_triangle_do_not_matter(mitsuba: Any, stray: float) -> None:
    """A sheet with a vertex far away, or nowhere, is still seen from both sides."""
    from purelight_train.light.visible_part import visible_part

    globe = trimesh.creation.icosphere(3)
    corners = np.asarray(globe.vertices, np.float32)
    faces = np.asarray(globe.faces, np.uint32)[globe.triangles_center[:, 2] < 0]
    corners = np.concatenate(([[stray, 0, 0]], corners)).astype(np.float32)
    surface = visible_part(corners, faces + 1, None, 1 << 16, np.random.default_rng(0))
    assert surface.two_sided.all()
    assert surface.sphere.radius == pytest.approx(1, abs=0.01)
