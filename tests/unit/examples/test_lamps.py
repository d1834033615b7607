"""The lamps of the gallery: sound shapes, light as they say, and most of it gets out."""

from __future__ import annotations

import dataclasses
import math
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from purelight_examples.luminaires import crystal, filament_bulb, frosted_globe
from purelight_examples.luminaires.catalog import CATALOG, Entry
from purelight_examples.luminaires.lamp_scene import emitted_flux
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_mitsuba import platform
from tests.support import soundness

HELD_IN_GLASS = {"crystal", "filament_bulb", "frosted_globe"}  # metal goes through their glass
NEW = [name for name in CATALOG if name not in HELD_IN_GLASS]
RAYS = 1 << 15
WHITE = {
    "diffuse": '<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>',
    "dielectric": '<bsdf type="dielectric"/>',
    "principledthin": '<bsdf type="thindielectric"/>',
}  # what has no loss: opaque, glass, thin


@pytest.fixture(params=CATALOG.values(), ids=CATALOG.keys())
def entry(request: pytest.FixtureRequest) -> Entry:
    return request.param


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Enough rays to judge a lamp by, not to train it from."""
    from purelight_train.light import light_tracing, luminaire, visible_part

    monkeypatch.setattr(visible_part, "LEAVING_RAYS", RAYS)
    monkeypatch.setattr(visible_part, "PER_TRIANGLE", (2, 16))
    monkeypatch.setattr(light_tracing, "BATCH", RAYS)
    monkeypatch.setattr(luminaire, "VISIBILITY_RAYS", RAYS)


@pytest.fixture
def strict() -> Iterator[None]:
    """Warnings are errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def bodies(entry: Entry) -> list[soundness.Body]:
    return [soundness.Body(part.name, part.mesh, part.solid) for part in entry.lamp.parts()]


@pytest.mark.parametrize("name", NEW)
def test_bodies_are_sound(name: str) -> None:
    """Closed, wound outwards, apart from each other, and none inside another."""
    assert soundness.faults(bodies(CATALOG[name])) == []


@pytest.mark.parametrize("name", sorted(HELD_IN_GLASS))
def test_meshes_are_closed_and_touch_nowhere(name: str) -> None:
    parts = CATALOG[name].lamp.parts()
    assert all(part.mesh.is_watertight and part.mesh.is_winding_consistent for part in parts)
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    assert len(np.unique(vertices.round(9), axis=0)) == len(vertices)


def test_is_small_enough_to_trace_and_named_apart(entry: Entry) -> None:
    parts = entry.lamp.parts()
    assert sum(len(part.mesh.faces) for part in parts) < 60_000
    assert len({part.name for part in parts}) == len(parts)
    corners = np.concatenate([part.mesh.vertices for part in parts])
    assert 0.05 < 0.5 * np.linalg.norm(np.ptp(corners, axis=0)) < 0.4


def test_writes_the_same_files_twice(entry: Entry, tmp_path: Path) -> None:
    first, second = entry.lamp.write(tmp_path / "a"), entry.lamp.write(tmp_path / "b")
    files = sorted(p.relative_to(tmp_path / "a") for p in first.parent.rglob("*") if p.is_file())
    assert len(files) == len(entry.lamp.parts()) + 1
    for file in files:
        assert (first.parent / file).read_bytes() == (second.parent / file).read_bytes()


@pytest.mark.usefixtures("strict")
def test_loads_without_a_warning_and_most_light_escapes(entry: Entry, tmp_path: Path) -> None:
    mi = platform.use()
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import load_luminaire

    lamp = load_luminaire(entry.lamp.write(tmp_path))
    shining = [shape for shape in lamp.scene.shapes() if shape.is_emitter()]
    assert len(shining) == 1
    assert not shining[0].has_vertex_normals()
    records = trace_records(lamp.scene, RAYS, seed=0)
    emitted = np.array(emitted_flux(entry.lamp.parts()))
    assert (records.flux < emitted).all()
    assert records.flux[0] > 0.5 * emitted[0]
    assert records.flux.sum() > 0.4 * emitted.sum()  # coloured glass and metal take green and blue
    assert mi.variant() == "llvm_ad_rgb"


@pytest.mark.filterwarnings("ignore:.*light paths cut off")
def test_nothing_is_lost_where_nothing_absorbs(entry: Entry, tmp_path: Path) -> None:
    """The same shapes of lossless materials: what leaves is what emitters give."""
    mi = platform.use()
    from purelight_train.light.light_tracing import trace_records

    path = entry.lamp.write(tmp_path)
    lossless(path)
    scene = mi.load_file(str(path))
    records = trace_records(scene, RAYS, seed=0)
    emitted = np.array(emitted_flux(entry.lamp.parts()))
    cut = records.cut / records.paths
    np.testing.assert_allclose(records.flux / emitted, 1 - 0.5 * cut, atol=0.01 + 0.5 * cut)
    assert cut < 0.02


def lossless(path: Path) -> None:
    """Turn a lamp's scene file white."""
    tree = ET.parse(path)
    for shape in tree.getroot().iter("shape"):
        bsdf = shape.find("bsdf")
        assert bsdf is not None
        kind = bsdf.attrib["type"].replace("rough", "")
        white = ET.fromstring(WHITE.get(kind, WHITE["diffuse"]))
        if kind == "dielectric":
            white.extend(e for e in bsdf if e.get("name") in ("int_ior", "ext_ior"))
        shape.remove(bsdf)
        shape.append(white)
    tree.write(path)


def test_a_body_that_stands_in_another_would_be_found() -> None:
    parts = bodies(CATALOG["modern"])
    mesh = trimesh.creation.icosphere(radius=0.002)
    at = next(part for part in parts if part.name == "rose").mesh.triangles_center[0]
    fault = soundness.Body("bead", mesh.apply_translation(at))
    assert soundness.faults([*parts, fault]) != []


@pytest.mark.parametrize("name", NEW)
def test_emitters_give_the_lumens_that_they_are_asked_for(name: str) -> None:
    lamp = CATALOG[name].lamp
    twice = dataclasses.replace(lamp, lumens=2 * lamp.lumens)  # type: ignore[attr-defined]
    one, two = (lumens(np.array(emitted_flux(made.parts()))) for made in (lamp, twice))
    count = round(one / lamp.lumens)  # type: ignore[attr-defined]
    assert one == pytest.approx(count * lamp.lumens)  # type: ignore[attr-defined]
    assert count == {"cluster": 7, "vintage_simple": 15, "vintage_complex": 15,
                     "wall_sconce": 2}.get(name, 1)  # fmt: skip
    assert two == pytest.approx(2 * one)


def lumens(watts: np.ndarray) -> float:
    return float(LUMENS_PER_WATT * (LUMINANCE @ watts))


def test_lamps_follow_their_parameters() -> None:
    """Other numbers of things, still sound."""
    from purelight_examples.luminaires.cluster import Cluster
    from purelight_examples.luminaires.flower import Flower, Layer
    from purelight_examples.luminaires.medieval import Medieval
    from purelight_examples.luminaires.street_light import StreetLight

    made = [
        Cluster(lobes=4, reach=0.11), Medieval(columns=2, rows=4, height=0.17),
        Flower(layers=(Layer(7, 0.12, 0.04, 20.0, 60.0, 0.03),)), StreetLight(rows=3, columns=2),
    ]  # fmt: skip
    for lamp in made:
        assert soundness.faults(bodies(Entry(lamp, "", "hung"))) == [], lamp.name
    parts = {part.name: part.mesh for part in made[0].parts()}
    assert parts["globes"].body_count == 2 * 5
    assert {p.name: p.mesh for p in made[3].parts()}["lenses"].body_count == 6


def test_a_street_light_throws_along_the_street(tmp_path: Path) -> None:
    """At 60 degrees from straight down more than twice as much as towards the houses."""
    mi = platform.use()
    from purelight_train.light.light_tracing import trace_records

    records = trace_records(
        mi.load_file(str(CATALOG["street_light"].lamp.write(tmp_path))), RAYS, 0
    )
    power = records.weight.sum(1)

    def intensity(axis: int) -> float:
        toward = np.array([0.0, 0.0, -0.5])
        toward[axis] = math.sqrt(0.75)
        mirrored = np.abs(records.direction) * (1, 1, -1)
        down = records.direction[:, 2] < 0
        return float(power[down & (mirrored @ toward > math.cos(math.radians(8)))].sum())

    assert intensity(1) > 2 * intensity(0)


@pytest.mark.parametrize("name", ["downlight", "linear_led", "street_light"])
def test_leds_shine_from_their_fronts_alone(name: str) -> None:
    (leds,) = (part for part in CATALOG[name].lamp.parts() if part.radiance is not None)
    assert (leds.mesh.face_normals[:, 2] < -0.999).all()


@pytest.mark.parametrize("module", [crystal, filament_bulb, frosted_globe])
def test_a_lamp_by_default_is_that_of_the_catalog(module: object, tmp_path: Path) -> None:
    name = module.__name__.rpartition(".")[2]  # type: ignore[attr-defined]
    one = module.write(tmp_path / "a")  # type: ignore[attr-defined]
    other = CATALOG[name].lamp.write(tmp_path / "b")
    assert one.read_bytes() == other.read_bytes()
