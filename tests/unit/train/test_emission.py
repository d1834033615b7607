"""Emitters by power: the flux stays, the noise falls; emission from textures and points."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from purelight_format.errors import PureLightError

RADIANCES = (100.0, 1.0, 0.01)
RADIUS = 0.1


def spheres(mi: Any, radiances: tuple[float, ...]) -> Any:
    """A row of black glowing spheres."""
    return mi.load_dict(
        {
            "type": "scene",
            **{
                f"bulb{i}": {
                    "type": "sphere",
                    "center": [3 * RADIUS * i, 0, 0],
                    "radius": RADIUS,
                    "bsdf": {"type": "diffuse", "reflectance": 0.0},
                    "emitter": {"type": "area", "radiance": value},
                }
                for i, value in enumerate(radiances)
            },
        }
    )


def test_power_of_each_emitter(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import Lamp

    scene = spheres(mitsuba, RADIANCES)
    emission = Lamp(scene).emission
    power = 4 * math.pi**2 * RADIUS**2 * np.array(RADIANCES)
    np.testing.assert_allclose(emission.power(), np.tile(power[:, None], 3), rtol=1e-5)
    assert emission.probability.sum() == pytest.approx(1)
    assert emission.probability[2] > 0.003  # never left out


def test_flux_is_the_same_and_noise_falls(mitsuba: Any) -> None:
    """Against emitters chosen uniformly; the spheres shade each other, so it is no closed form."""
    from purelight_train.light.emission import Emission
    from purelight_train.light.light_tracing import Lamp, trace_records

    scene = spheres(mitsuba, RADIANCES)
    chosen = trace_records(scene, 1 << 20, 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "purelight_train.light.emission._probability", lambda power: np.full(len(power), 1 / 3)
        )
        uniform = trace_records(scene, 1 << 20, 1)
        assert Lamp(scene).emission.probability[0] == pytest.approx(1 / 3)
    error = np.hypot(chosen.flux_error, uniform.flux_error)
    assert (np.abs(chosen.flux - uniform.flux) < 4 * error).all()
    variance_ratio = (uniform.flux_error / chosen.flux_error) ** 2
    assert (variance_ratio > 10).all(), variance_ratio
    assert Emission.of(scene, 1.0).probability[0] > 0.9


def test_an_emitter_that_outlived_its_shape_disturbs_nobody(mitsuba: Any) -> None:
    from purelight_import.sanity.light import leaving
    from purelight_import.sanity.subject import Subject
    from purelight_train.light.light_tracing import trace_records

    kept = spheres(mitsuba, (1.0,)).emitters()  # of a scene that is gone
    scene, flux = spheres(mitsuba, (5.0,)), 4 * math.pi**2 * RADIUS**2 * 5
    np.testing.assert_allclose(trace_records(scene, 1 << 14, 0).flux, flux, rtol=1e-3)
    np.testing.assert_allclose(leaving(Subject(scene)).left.sum(0), flux, rtol=1e-3)
    assert len(kept) == 1


def test_a_faint_channel_gets_half_of_the_paths(mitsuba: Any) -> None:
    from purelight_train.light.emission import _probability

    power = np.array([[100.0, 0, 0], [0, 0, 0.1]])
    np.testing.assert_allclose(_probability(power), 0.5)
    assert (_probability(np.zeros((4, 3))) == 0.25).all()


def test_textured_emitter_keeps_its_picture(mitsuba: Any) -> None:
    """A square with a dark and a bright half: power, and where it comes from."""
    from purelight_train.light.light_tracing import trace_records

    picture = np.zeros((1, 2, 3), np.float32)
    picture[0, :] = [[1.0, 0.5, 0.0], [9.0, 4.5, 0.0]]
    bitmap = {
        "type": "bitmap",
        "bitmap": mitsuba.Bitmap(picture),
        "filter_type": "nearest",
        "raw": True,
    }
    square = {"type": "rectangle", "emitter": {"type": "area", "radiance": bitmap}}
    records = trace_records(mitsuba.load_dict({"type": "scene", "square": square}), 1, 0)
    expected = np.array([5.0, 2.5, 0.0]) * 4 * math.pi
    assert (np.abs(records.flux - expected) <= 4 * records.flux_error + 1e-6).all()
    bright = records.position[:, 0] > 0
    assert records.weight[bright, 0].sum() / records.weight[:, 0].sum() == pytest.approx(
        0.9, abs=2e-3
    )


def test_point_and_area_emitters_together(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records

    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "point": {"type": "point", "position": [0, 0, 3.0], "intensity": 2.0},
            "plate": {
                "type": "rectangle",
                "bsdf": {"type": "diffuse", "reflectance": 0.0},
                "emitter": {"type": "area", "radiance": 1.0},
            },
        }
    )
    records = trace_records(scene, 1, 0)
    # The black plate takes the part of the point's light within its solid angle
    solid_angle = 4 * math.asin(1 / 10)
    expected = 4 * math.pi + 2.0 * (4 * math.pi - solid_angle)
    assert (np.abs(records.flux - expected) < 4 * records.flux_error).all()


SIZE = (1.0, 2.0, 3.0)  # half of a box


def painted(mi: Any, name: str, channels: int = 3, *, flip: bool = False) -> tuple[Any, Any]:
    """A black box that shines in colours of its vertices or faces, beside a faint ball.

    Returns:
        The scene, and the radiance of each of the twelve faces, [12, 3].
    """
    emitter = {"type": "area", "radiance": {"type": "mesh_attribute", "name": name}}
    box = mi.load_dict(
        {
            "type": "cube", "to_world": mi.ScalarTransform4f().scale(SIZE), "face_normals": True,
            "flip_normals": flip, "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "emitter": emitter, "id": "box",
        }
    )  # fmt: skip
    faces = np.array(mi.traverse(box)["faces"]).reshape(-1, 3)
    on_vertices = name.startswith("vertex_")
    count = 24 if on_vertices else 12
    colors = np.random.default_rng(0).uniform(0, 9, (count, channels)).astype(np.float32)
    box.add_attribute(name, channels, colors.ravel())
    ball = {
        "type": "sphere", "center": [0, 0, 20.0], "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": 1e-3},
    }  # fmt: skip
    radiance = colors[faces].mean(1) if on_vertices else colors
    scene = mi.load_dict({"type": "scene", "box": box, "ball": ball})
    return scene, np.broadcast_to(radiance, (12, 3))


def face_areas(mi: Any, scene: Any) -> tuple[np.ndarray, np.ndarray]:
    """Areas [12] and unit normals [12, 3] of the box."""
    (box,) = [shape for shape in scene.shapes() if shape.is_mesh()]
    parameters = mi.traverse(box)
    vertices = np.array(parameters["vertex_positions"]).reshape(-1, 3)
    a, b, c = vertices[np.array(parameters["faces"]).reshape(-1, 3).T]
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return length / 2, cross / length[:, None]


@pytest.mark.parametrize(
    ("name", "channels"),
    [("vertex_color", 3), ("face_color", 3), ("vertex_grey", 1), ("face_grey", 1)],
)
def test_colours_of_a_mesh_shine(name: str, channels: int, mitsuba: Any) -> None:
    """Power, and how much leaves each side of the box; by the areas and the means of the faces."""
    from purelight_train.light.light_tracing import Lamp, trace_records

    scene, radiance = painted(mitsuba, name, channels)
    areas, normals = face_areas(mitsuba, scene)
    power = math.pi * areas[:, None] * radiance
    emission = Lamp(scene).emission
    np.testing.assert_allclose(emission.power()[0], power.sum(0), rtol=0.02)
    brightest = np.max(emission.brightest())
    assert radiance.max() < brightest <= 9.0 or brightest == pytest.approx(radiance.max())
    records = trace_records(scene, 1, 0)
    for normal in np.unique(normals.round(), axis=0):
        side = np.abs(records.position @ normal - np.abs(normal) @ SIZE) < 5e-3  # lifted
        wanted = power[normals @ normal > 0.99].sum(0)
        found = records.weight[side].sum(0, dtype=np.float64) / records.paths
        np.testing.assert_allclose(found, wanted, rtol=0.01, atol=0.005 * power.sum(0).max())


def test_a_mesh_of_colours_shines_where_a_path_tracer_sees_it(mitsuba: Any) -> None:
    """At the points that begin paths, rays from outside meet the same radiance."""
    from purelight_train.light.light_tracing import Lamp

    mi = mitsuba
    scene, _ = painted(mi, "vertex_color")
    emission = Lamp(scene).emission
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, 1 << 12)
    index = mi.UInt32(sampler.next_1d() * 2)
    si, _ = emission.place(index, sampler.next_2d())
    si.wi = mi.Vector3f(0, 0, 1)
    met = scene.ray_intersect(mi.Ray3f(si.p + 0.5 * si.n, -si.n))
    wanted = np.array(met.emitter(scene).eval(met))
    found = np.array(emission.at(index)[0].eval(si))
    assert len(np.unique(wanted[0].round(2))) > 100
    np.testing.assert_allclose(found, wanted, atol=1e-3)


@pytest.mark.parametrize("flip", [False, True])
def test_a_mesh_of_colours_shines_to_its_front(flip: bool, mitsuba: Any) -> None:
    from purelight_train.light.emission import Emission

    scene, _ = painted(mitsuba, "face_color", flip=flip)
    emission = Emission.of(scene, mitsuba.Float(1))
    sampler = mitsuba.load_dict({"type": "independent"})
    sampler.seed(0, 1 << 10)
    box = [shape.is_mesh() for shape in scene.shapes()].index(True)
    start = emission._emit(mitsuba.UInt32([box]) + 0 * mitsuba.UInt32(range(1 << 10)), sampler)
    outward = np.array(start.ray.o + 1e-3 * start.ray.d).T
    outside = (np.abs(outward) > np.array(SIZE)).any(1)
    assert outside.mean() == pytest.approx(0.0 if flip else 1.0, abs=0.02)


@pytest.mark.parametrize(
    ("name", "channels", "asked"),
    [("face_two", 2, "face_two"), ("face_color", 3, "vertex_color"), ("vertex_six", 6, None)],
)
def test_colours_that_a_mesh_lacks_are_one_line(
    name: str, channels: int, asked: str | None, mitsuba: Any
) -> None:
    from purelight_train.light.emission import Emission

    box = {"type": "area", "radiance": {"type": "mesh_attribute", "name": asked or name}}
    mesh = mitsuba.load_dict({"type": "cube", "id": "box", "emitter": box})
    count = 24 if name.startswith("vertex_") else 12
    mesh.add_attribute(name, channels, np.ones(count * channels, np.float32))
    scene = mitsuba.load_dict({"type": "scene", "box": mesh})
    with pytest.raises(PureLightError, match=f"emitter 'box' shines in '{asked or name}'"):
        Emission.of(scene, mitsuba.Float(1))


@pytest.mark.parametrize("pictured", [False, True])
def test_the_light_of_a_spot_is_a_needle(pictured: bool, mitsuba: Any) -> None:
    """A picture does not give it an area."""
    from purelight_train.light.light_tracing import trace_records

    spot: dict[str, Any] = {"type": "spot", "intensity": 10.0}
    if pictured:
        pixels = np.ones((2, 2, 3), np.float32)
        spot["texture"] = {"type": "bitmap", "bitmap": mitsuba.Bitmap(pixels), "raw": True}
    ball = {"type": "sphere", "center": [0, 0, -0.5], "radius": 0.1}
    records = trace_records(mitsuba.load_dict({"type": "scene", "spot": spot, "ball": ball}), 1, 0)
    assert records.needles == pytest.approx(records.flux.sum() * records.paths, rel=1e-5)


def test_a_mesh_of_colours_and_a_point_light_together(mitsuba: Any) -> None:
    """Mitsuba cannot sample rays of the one, and is asked for those of the other alone."""
    from purelight_train.light.emission import Emission

    mi = mitsuba
    lit = {"type": "area", "radiance": {"type": "mesh_attribute", "name": "face_grey"}}
    box = mi.load_dict({"type": "cube", "emitter": lit})
    box.add_attribute("face_grey", 1, np.full(12, 2.0, np.float32))
    lights = {"lamp": {"type": "point", "intensity": 3.0}, "other": {"type": "spot"}}
    scene = mi.load_dict({"type": "scene", "box": box, **lights})
    power = sorted(Emission.of(scene, mi.Float(1)).power()[:, 0])
    np.testing.assert_allclose(power[1:], [4 * math.pi * 3, math.pi * 24 * 2], rtol=1e-4)
