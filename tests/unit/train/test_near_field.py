"""Light between the parts of a concave lamp: recorded where it leaves them, with all its power."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.support.irradiance import FORM_FACTOR

PLATES = """<scene version="3.0.0">
  <shape type="rectangle"><transform name="to_world"><scale value="0.5"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="3,2,0"/></emitter></shape>
  <shape type="rectangle">
    <transform name="to_world"><scale value="0.5"/><rotate x="1" angle="180"/>
      <translate z="{gap}"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="{reflectance}"/></bsdf></shape>
</scene>"""


@pytest.fixture
def plates(mitsuba: Any, tmp_path: Any) -> Any:
    """A glowing square and one that hangs over it."""
    from purelight_train.light.luminaire import load_luminaire

    def load(reflectance: float, gap: float = 1.0) -> Any:
        path = tmp_path / f"plates{reflectance}-{gap}.xml"
        path.write_text(PLATES.format(reflectance=reflectance, gap=gap))
        return load_luminaire(path)

    return load


def crossings(luminaire: Any, seed: int = 0) -> Any:
    """Light of a million paths as a viewer meets it, and its triangle."""
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records

    surface = luminaire.exit_surface
    return settle(trace_records(luminaire.scene, 1, seed, surface=surface), surface)


def test_light_that_stays_has_its_power(plates: Any) -> None:
    """What goes from the lower square to the upper one is the form factor's part of it."""
    seen, _ = crossings(plates(0))
    emitted = math.pi * np.array([3.0, 2.0, 0.0])
    stays = seen.take(~seen.escaped)
    power = stays.weight.sum(0, dtype=np.float64) / seen.paths
    np.testing.assert_allclose(power, FORM_FACTOR * emitted, rtol=5e-3)
    np.testing.assert_allclose(seen.flux, (1 - FORM_FACTOR) * emitted, rtol=2e-3)
    assert (stays.position[:, 2] < 1e-6).all()
    assert (stays.normal[:, 2] > 0.999).all()
    assert (stays.free > 0.999).all()


def test_light_that_meets_the_lamp_often(plates: Any) -> None:
    """Two squares that pass light to and fro: each crossing counts, by balance of the powers."""
    r = 0.8
    seen, _ = crossings(plates(r))
    stays = seen.take(~seen.escaped)
    up = stays.normal[:, 2] > 0
    emitted = math.pi * 3.0
    power = [stays.weight[side, 0].sum(dtype=np.float64) / seen.paths for side in (up, ~up)]
    assert power[0] == pytest.approx(FORM_FACTOR * emitted, rel=5e-3)
    # Nearly even light from below leaves the upper square nearly as diffuse light
    assert power[1] == pytest.approx(r * FORM_FACTOR**2 * emitted, rel=0.15)
    assert power[1] > 0.9 * r * FORM_FACTOR**2 * emitted


def test_convex_lamps_have_none(mitsuba: Any) -> None:
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.visible_part import visible_part

    glass = {"type": "sphere", "bsdf": {"type": "dielectric"}}
    bulb = {"type": "sphere", "radius": 0.1, "emitter": {"type": "area", "radiance": 1.0}}
    scene = mitsuba.load_dict({"type": "scene", "glass": glass, "bulb": bulb})
    surface = visible_part(*scene_triangles(scene), 1 << 16, np.random.default_rng(0))
    assert not surface.concave
    assert trace_records(scene, 1, 0, surface=surface).escaped.all()


def test_light_inside_of_glass_is_no_crossing(mitsuba: Any, tmp_path: Any) -> None:
    """Under a shade hangs a thick globe: what goes to and fro within its wall nobody sees."""
    from purelight_train.light.luminaire import load_luminaire

    path = tmp_path / "globe.xml"
    path.write_text("""<scene version="3.0.0">
      <shape type="sphere"><float name="radius" value="0.2"/><emitter type="area">
        <rgb name="radiance" value="1"/></emitter></shape>
      <shape type="sphere"><bsdf type="dielectric"/></shape>
      <shape type="sphere"><float name="radius" value="0.8"/>
        <boolean name="flip_normals" value="true"/><bsdf type="dielectric"/></shape>
      <shape type="disk"><transform name="to_world"><scale value="1.5"/><rotate x="1" angle="180"/>
        <translate z="1.5"/></transform>
        <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape></scene>""")
    luminaire = load_luminaire(path)
    seen, _ = crossings(luminaire)
    stays = seen.take(~seen.escaped)
    assert len(stays) > 1000
    radius = np.linalg.norm(stays.position, axis=1)
    on_globe = radius < 1.01
    np.testing.assert_allclose(radius[on_globe], 1, atol=2e-3)
    outward = np.einsum("nd,nd->n", stays.position, stays.direction)[on_globe]
    assert (outward > 0).all()
    assert (np.einsum("nd,nd->n", stays.normal, stays.direction) > 0).all()


OPAL = """<scene version="3.0.0">
  <shape type="sphere"><float name="radius" value="0.1"/><bsdf type="dielectric"/>{milk}</shape>
  <shape type="sphere"><float name="radius" value="0.09"/>
    <boolean name="flip_normals" value="true"/><bsdf type="dielectric"/>{milk}</shape>
  <shape type="sphere"><float name="radius" value="0.02"/>
    <emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>
  <shape type="sphere"><point name="center" x="0.2" y="0" z="0"/><float name="radius" value="0.02"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></shape>
</scene>"""
MILK = """<medium type="homogeneous" name="interior"><float name="scale" value="{scale}"/>
  <rgb name="sigma_t" value="1"/><rgb name="albedo" value="1"/></medium>"""


@pytest.mark.parametrize("scale", [0, 300])
def test_light_that_turns_within_milky_glass_is_no_crossing(
    scale: float, mitsuba: Any, tmp_path: Any
) -> None:
    """It has not left the glass where it last met it."""
    from purelight_train.light.luminaire import load_luminaire

    path = tmp_path / "opal.xml"
    path.write_text(OPAL.format(milk=MILK.format(scale=scale) if scale else ""))
    luminaire = load_luminaire(path)
    surface = luminaire.exit_surface
    seen, _ = crossings(luminaire)
    lifted = seen.position + 1e-4 * surface.sphere.radius * seen.normal
    free = np.ones(len(seen), bool)
    free[surface.intersect(lifted, seen.direction).index] = False
    power = seen.weight[:, 0]
    assert (~seen.escaped).any()
    assert power[free].sum() == pytest.approx(power[seen.escaped].sum(), rel=0.01)


def test_points_between_learn_the_light_they_see(plates: Any, mitsuba: Any) -> None:
    """A small student knows the lower square's light upwards, which never escapes, and the upper's.

    Before crossings were recorded, it had only what it made of light that misses the other square.
    """
    import dataclasses

    import torch

    from purelight_train.learning.photon_batches import PhotonBatches
    from purelight_train.learning.photon_loss import chosen_loss, student_loss
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.description import Description
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.networks.student import Student
    from purelight_train.presets import DRAFT, GridSize, MLPSize

    luminaire = plates(0.8)
    records = trace_records(luminaire.scene, 1, 1, surface=luminaire.exit_surface)
    description = Description.of(records, luminaire)
    small = dataclasses.replace(
        DRAFT, student_grid=GridSize(2, 2, 4, 16, 1 << 12), student_network=MLPSize(24, 2)
    ).for_route("photons")
    torch.manual_seed(0)
    student = Student(description, small)
    surface = luminaire.exit_surface
    references = ReferenceRays.of(surface, *settle(records, surface))
    batches = PhotonBatches(luminaire, description, references, torch.device("cpu"))
    adam, rng = torch.optim.Adam(student.parameters(), lr=1e-2), np.random.default_rng(0)
    loss = chosen_loss(small, torch.tensor([10.0, 10.0]))
    for step in range(250):
        adam.param_groups[0]["lr"] = 1e-2 * 0.5 * (1 + math.cos(math.pi * step / 250))
        adam.zero_grad()
        student_loss(student, *batches.draw(rng, 1 << 11), loss).backward()
        adam.step()

    def radiance(position: list[float], outgoing: list[float]) -> np.ndarray:
        spot = np.random.default_rng(1).uniform(-0.1, 0.1, (64, 3)) * [1, 1, 0] + position
        normal = np.tile([0, 0, np.sign(outgoing[2])], (64, 1))
        rays = (spot, normal, np.tile(outgoing, (64, 1)))
        with torch.no_grad():
            value = student(*(torch.from_numpy(a.astype(np.float32)) for a in rays))
        return value.numpy().mean(0)

    np.testing.assert_allclose(radiance([0, 0, 0], [0, 0, 1])[:2], [3, 2], rtol=0.1)
    # In the middle the lower square fills 0.2394 of the upper one's view (Howell, C-12)
    np.testing.assert_allclose(radiance([0, 0, 1], [0, 0, -1])[0], 0.8 * 0.2394 * 3, rtol=0.15)


def test_thinning_changes_no_ratio(plates: Any, mitsuba: Any) -> None:
    """Between close squares few rays stay; photons over references are, in any place, as before."""
    from purelight_train.learning.photon_batches import seen_photons
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.learning.thinning import Thinning
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records

    luminaire = plates(0.8, 0.2)
    surface = luminaire.exit_surface
    records = trace_records(luminaire.scene, 1, 1, surface=surface)
    references = ReferenceRays.of(surface, *settle(records, surface))
    thinning, rng = Thinning(references), np.random.default_rng(0)
    drawn = references.sample(1 << 19, rng)
    seen = seen_photons(records, references, records.flux)
    few, rays = thinning.photons(seen, rng), thinning.rays(drawn, rng)
    assert len(rays[0]) < 0.9 * len(drawn[0])
    assert thinning.kept == pytest.approx(len(rays[0]) / len(drawn[0]), rel=5e-3)

    def ratio(photons: Any, references: Any, place: Any) -> float:
        """Light over what is drawn where `place` says so."""
        ours, theirs = place(photons), place(references)
        return float((photons[-1][:, 0] * ours).mean() / theirs.mean())

    def between(rays: Any) -> Any:
        """Up from the lower square's middle, to the upper one."""
        position, _, outgoing = rays[:3]
        middle = (np.abs(position).max(1) < 0.3) & (position[:, 2] < 0.1)
        return middle & (outgoing[:, 2] > 0.9)

    def aside(rays: Any) -> Any:
        """Off the upper square's edge, so low that the lower one is missed."""
        position, _, outgoing = rays[:3]
        low = (outgoing[:, 2] < 0) & (outgoing[:, 0] > -2 * outgoing[:, 2])
        return (position[:, 0] > 0.4) & (position[:, 2] > 0.1) & low

    for place in (between, aside):
        assert ratio(few, rays, place) == pytest.approx(ratio(seen, drawn, place), rel=0.03)
    assert (thinning.share(*(a[aside(drawn)] for a in drawn[:3])) == 1).all()


def test_deep_shade_has_an_inside(mitsuba: Any) -> None:
    """A long open tube of sheet metal shows its inside to few rays; who looks up it sees it."""
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.visible_part import visible_part

    tube = mitsuba.load_dict({"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, 40], "radius": 1})
    ball = mitsuba.load_dict({"type": "sphere", "center": [0, 0, 50], "radius": 3})
    scene = mitsuba.load_dict({"type": "scene", "tube": tube, "ball": ball})
    surface = visible_part(*scene_triangles(scene), 1 << 20, np.random.default_rng(0))
    height = surface.positions[surface.triangles].mean(1)[:, 2]
    assert surface.two_sided[height < 41].all()
    assert not surface.two_sided[height > 41].any()


def test_bulb_deep_in_a_shade_has_no_holes(mitsuba: Any) -> None:
    """Few rays from outside meet it; whoever looks up the tube must never see it from behind."""
    from purelight_train.light.exit_surface import inward_rays
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.visible_part import visible_part

    tube = mitsuba.load_dict({"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, 9], "radius": 1})
    bulb = mitsuba.load_dict({"type": "sphere", "center": [0, 0, 4], "radius": 0.7})
    scene = mitsuba.load_dict({"type": "scene", "tube": tube, "bulb": bulb})
    surface = visible_part(*scene_triangles(scene), 1 << 12, np.random.default_rng(0))
    rays = inward_rays(surface.sphere, 1 << 21, np.random.default_rng(1), cosine=True)
    hits = surface.intersect(*rays)
    on_bulb = np.linalg.norm(hits.position - [0, 0, 4], axis=1) < 0.8
    assert on_bulb.sum() > 1000
    assert hits.front[on_bulb].all()
