"""Light tracing: power is conserved, exits are Lambertian where they must be."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.errors import PureLightError

RADIUS = 0.1
RADIANCE = (3.0, 2.0, 1.0)
BARE = {
    "type": "sphere",
    "radius": RADIUS,
    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(RADIANCE)}},
    "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
}
EMITTED = math.pi * 4 * math.pi * RADIUS**2 * np.array(RADIANCE)


def shell(bsdf: dict[str, Any]) -> dict[str, Any]:
    return {
        "outer": {"type": "sphere", "radius": 0.5, "bsdf": bsdf},
        "inner": {"type": "sphere", "radius": 0.4, "flip_normals": True, "bsdf": bsdf},
    }


def test_bare_emitter_keeps_its_flux(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    records = trace_records(mitsuba.load_dict({"type": "scene", "bulb": BARE}), 1 << 18, 0)
    np.testing.assert_allclose(records.flux, EMITTED, rtol=1e-5)
    assert records.bare.all()
    cosine = np.einsum("nd,nd->n", records.position / RADIUS, records.direction)
    assert np.mean(cosine) == pytest.approx(2 / 3, abs=2e-3)


def test_clear_white_lamp_loses_nothing(mitsuba: Any) -> None:
    """Smooth glass absorbs nothing and a white bulb returns all: power in is power out."""
    from purelight_train.light.light_tracing import trace_records

    white = {**BARE, "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}}
    glass = shell({"type": "dielectric", "int_ior": 1.5})
    scene = mitsuba.load_dict({"type": "scene", "bulb": white, **glass})
    records = trace_records(scene, 1 << 20, 0)
    np.testing.assert_allclose(records.flux, EMITTED, rtol=4e-3)
    assert not records.bare.any()
    assert (np.einsum("nd,nd->n", records.normal, records.direction) > 0).all()


def test_same_seed_same_records(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    scene = mitsuba.load_dict({"type": "scene", "bulb": BARE, **shell({"type": "dielectric"})})
    a, b, c = (trace_records(scene, 1, seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.weight, b.weight)
    assert not np.array_equal(a.position[:100], c.position[:100])


def test_dark_lamp_is_refused(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    black = {**BARE, "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 0.0}}}
    with pytest.raises(PureLightError, match="emits nothing"):
        trace_records(mitsuba.load_dict({"type": "scene", "bulb": black}), 1, 0)


def test_path_tracing_agrees_on_a_plane(mitsuba: Any, lamp: Path) -> None:
    """Irradiance of light tracing and of Mitsuba's path tracer: mean within four deviations."""
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.truth.plane import Plane, plane_irradiance

    scene = mitsuba.load_file(str(lamp))
    plane = Plane((0, 0, -0.3), 0.4, 4)
    light, light_error = plane_irradiance(trace_records(scene, 4 << 20, 0), plane)
    room = mitsuba.load_dict(
        {
            "type": "scene",
            "floor": {
                "type": "rectangle",
                "to_world": mitsuba.ScalarTransform4f().translate([0, 0, -0.3]).scale(0.2),
                "meter": {
                    "type": "irradiancemeter",
                    "film": {
                        "type": "hdrfilm",
                        "width": 4,
                        "height": 4,
                        "rfilter": {"type": "box"},
                        "pixel_format": "rgb",
                    },
                },
            },
            **{f"part{i}": s for i, s in enumerate(scene.shapes())},
        }
    )
    integrator = mitsuba.load_dict({"type": "path", "max_depth": 32})
    passes = [
        np.array(mitsuba.render(room, sensor=0, integrator=integrator, spp=1 << 15, seed=s))
        for s in range(8)
    ]
    path = np.mean(passes, axis=0)
    path_error = np.std(passes, axis=0, ddof=1) / math.sqrt(8)
    mean = light.mean((0, 1)), path.mean((0, 1))
    error = np.sqrt((light_error**2).sum((0, 1)) + (path_error**2).sum((0, 1))) / 16
    assert (np.abs(mean[0] - mean[1]) < 4 * error + 2e-3 * mean[0]).all(), (mean, error)
    assert (error < 0.02 * mean[0]).all()


SHADED = """<scene version="3.0.0">
  <shape type="sphere"><point name="center" x="0" y="0" z="{height}"/>
    <float name="radius" value="{radius}"/>
    <emitter type="area"><rgb name="radiance" value="1000"/></emitter></shape>
  <shape type="cylinder"><point name="p0" x="0" y="0" z="{low}"/>
    <point name="p1" x="0" y="0" z="{high}"/><float name="radius" value="0.3"/>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
</scene>"""


@pytest.mark.parametrize("height", [0.0, 2.5])
@pytest.mark.parametrize("radius", [5e-4, 5e-3])
def test_no_light_of_a_small_bare_bulb_is_lost(
    radius: float, height: float, mitsuba: Any, tmp_path: Any
) -> None:
    """In a large shade, where it is modelled or where it hangs: all that leaves it is met there."""
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import load_luminaire

    path = tmp_path / "shaded.xml"
    ends = {"low": height - 0.2, "high": height + 0.2}
    path.write_text(SHADED.format(radius=radius, height=height, **ends))
    luminaire = load_luminaire(path)
    surface = luminaire.exit_surface
    traced = trace_records(luminaire.scene, 1, 0, surface=surface)
    met, _ = settle(traced, surface)
    for escaped in (True, False):
        power = [
            float(r.weight[r.bare & (r.escaped == escaped)].sum(dtype=np.float64))
            for r in (traced, met)
        ]
        assert power[1] == pytest.approx(power[0], rel=0.005)
    lost = 4 * np.pi**2 * radius**2 * 1000
    bare = met.weight[met.bare, 0].sum(dtype=np.float64) / met.paths
    assert bare == pytest.approx(lost, rel=0.01)
