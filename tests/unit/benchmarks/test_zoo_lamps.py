"""Random lamps: the same from the same seed, and sound before any light is traced in them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from benchmarks.zoo.lamps import textures
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.families import FAMILIES
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.lamp import Lamp, enlarged, family_of, make
from benchmarks.zoo.lamps.pieces import Finish, Light, Piece
from benchmarks.zoo.lamps.placement import Placement, shift, turn
from benchmarks.zoo.lamps.plugin import bsdf
from purelight_mitsuba import platform
from tests.support import soundness

ROUND = len(FAMILIES)
MATT = Finish(bsdf("diffuse"), frozenset({"matt"}))
PARTS = [(0, 9), *(pytest.param(s, ROUND, marks=pytest.mark.slow) for s in range(1, 9))]


def faults(lamp: Lamp) -> list[str]:
    return soundness.faults(
        [soundness.Body(piece.name, piece.triangles, piece.solid) for piece in lamp.pieces]
    )


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


# The same lamps everywhere


def test_numbers_are_those_of_any_machine() -> None:
    """The raw bits of PCG64, which NumPy promises to keep."""
    draw = Draw(1, 2, 3)
    assert [draw.number() for _ in range(3)] == [
        0.6704722626516632, 0.1110146366693816, 0.5115090823948739,
    ]  # fmt: skip


def test_choices_are_as_likely_as_they_say() -> None:
    draw = Draw(5)
    counts = Counter(draw.pick("abc", (1, 2, 1)) for _ in range(4000))
    assert [counts[k] / 4000 for k in "abc"] == pytest.approx([0.25, 0.5, 0.25], abs=0.03)
    assert {draw.whole(2, 4) for _ in range(100)} == {2, 3, 4}
    assert sorted(draw.shuffled(range(9))) == list(range(9))


def test_a_seed_gives_the_same_files_twice(tmp_path: Path) -> None:
    for index in (0, 5, 11):
        a, b = tmp_path / f"{index}a", tmp_path / f"{index}b"
        make(7, index).write(a)
        make(7, index).write(b)
        assert files(a) == files(b)
        assert len(files(a)) > 1


def test_other_seeds_and_numbers_give_other_lamps() -> None:
    family = family_of(1, 0)
    others = [(seed, i) for seed in (1, 2) for i in range(2 * ROUND)]
    same = [make(*key) for key in others if family_of(*key) == family]
    assert len(same) == 4
    assert len({lamp.placement.scale for lamp in same}) == 4


def test_families_take_turns() -> None:
    for first in (0, ROUND):
        assert {family_of(3, first + i) for i in range(ROUND)} == set(FAMILIES)
    assert [family_of(3, i) for i in range(9)] != [family_of(4, i) for i in range(9)]


# What must hold of every lamp


@pytest.mark.parametrize(("seed", "count"), PARTS)
def test_every_lamp_is_sound(seed: int, count: int) -> None:
    """Closed bodies that do not meet, nothing inside a body, emitters, sizes within bounds."""
    for index in range(count):
        lamp = make(seed, index)
        assert faults(lamp) == [], (seed, lamp.name)
        names = [part.name for part in lamp.parts]
        assert len(set(names)) == len(names), (seed, lamp.name)
        description = lamp.description()
        assert 1 <= description["emitters"] <= 120, (seed, lamp.name)
        assert 0.0019 < description["radius_metres"] < 31, (seed, lamp.name)
        assert description["offset_radii"] <= 10.001, (seed, lamp.name)
        assert 0 <= description["self_view"] < 0.7, (seed, lamp.name)
        assert description["triangles"] < 150_000, (seed, lamp.name)
        json.dumps(description)


@pytest.mark.slow
def test_a_zoo_holds_what_it_promises() -> None:
    """Over a few rounds: every kind of material, light, size and place."""
    lamps = [make(seed, index) for seed in (1, 2, 3) for index in range(ROUND)]
    traits = Counter(trait for lamp in lamps for trait in lamp.traits)
    for wanted in (
        "clear", "rough", "thin", "coloured", "conductor", "plastic", "mask", "texture", "medium",
        "scattering", "smooth", "bump", "blend", "principled", "point", "spot", "analytic",
        "concave", "convex", "sheet", "cloth",
    ):  # fmt: skip
        assert traits[wanted] > 0, wanted
    emitters = [lamp.description()["emitters"] for lamp in lamps]
    assert min(emitters) == 1
    assert max(emitters) > 40
    sizes = [lamp.placement.scale * lamp.radius for lamp in lamps]
    assert min(sizes) < 0.02
    assert max(sizes) > 5
    assert any(np.linalg.norm(lamp.placement.offset) > 0 for lamp in lamps)


@pytest.mark.parametrize("count", [5, pytest.param(ROUND, marks=pytest.mark.slow)])
def test_lamps_load_in_mitsuba(tmp_path: Path, count: int) -> None:
    mi = platform.use()
    for index in range(count):
        lamp = make(1, index)
        scene = mi.load_file(str(lamp.write(tmp_path / lamp.name)))
        box, sphere = scene.bbox(), lamp.placement.scale * lamp.radius
        reach = np.abs(np.array([box.min, box.max]) - lamp.placement.offset).max()
        assert 0.5 * sphere < reach < 1.001 * sphere, lamp.name
        assert len(scene.emitters()) == lamp.description()["emitters"], lamp.name
        dark = mi.load_file(str(lamp.write(tmp_path / "dark", lit=False)))
        assert not dark.emitters()
        assert len(dark.shapes()) == len(scene.shapes())


# That the checks would find a fault


def ball(name: str, radius: float, at: float = 0.0, *, hollow: bool = False) -> Piece:
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    if hollow:
        mesh.invert()
    return Piece(name, Mesh(mesh), MATT).moved(shift(at))


def lamp_of(*pieces: Piece) -> Lamp:
    return Lamp(0, 0, "test", pieces, Placement())


def test_sound_lamps_have_no_faults() -> None:
    shell = [ball("outside", 1.0), ball("hollow", 0.9, hollow=True), ball("source", 0.3)]
    assert faults(lamp_of(*shell)) == []
    assert faults(lamp_of(*shell, ball("beside", 0.5, 2.0))) == []


def test_planted_faults_are_found() -> None:
    whole = ball("whole", 1.0)
    mesh = whole.triangles.copy()
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    found = faults(lamp_of(replace(whole, form=Mesh(mesh))))
    assert found == ["whole is not closed"]
    mesh = whole.triangles.copy()
    mesh.vertices[3] = np.nan
    found = faults(lamp_of(replace(whole, form=Mesh(mesh))))
    assert found == ["whole has corners that are no numbers"]
    assert "whole and other meet" in faults(lamp_of(whole, ball("other", 1.0, 1.5)))
    assert faults(lamp_of(whole, ball("inner", 0.5))) == ["inner stands in 1 bodies"]
    assert faults(lamp_of(ball("hollow", 1.0, hollow=True))) == ["hollow stands in 0 bodies"]


# Places, sizes, files


def test_enlarged_lamps_are_the_same_in_proportion(tmp_path: Path) -> None:
    mi = platform.use()
    lamp = make(1, 3)
    boxes = []
    for placement in (lamp.placement, enlarged(lamp, 20.0)):
        box = mi.load_file(str(lamp.write(tmp_path, placement))).bbox()
        corners = np.array([box.min, box.max], np.float64) - placement.offset
        boxes.append(corners / (placement.scale * lamp.radius))
    np.testing.assert_allclose(boxes[0], boxes[1], atol=2e-6)
    assert np.abs(boxes[0]).max() <= 1.0001


def test_bumps_are_as_high_in_proportion(tmp_path: Path) -> None:
    """They have a height in metres, which a lamp that is made larger has to take along."""
    numbers = [n for n in range(ROUND * 3) if family_of(1, n) == "balls"]
    lamp = next(lamp for n in numbers if "bump" in (lamp := make(1, n)).description()["traits"])
    heights = {}
    for placement in (lamp.placement, enlarged(lamp, 20.0)):
        root = ET.parse(lamp.write(tmp_path, placement)).getroot()
        bumps = root.findall(".//bsdf[@type='bumpmap']/float[@name='scale']")
        heights[placement.scale] = [float(bump.attrib["value"]) for bump in bumps]
    small, large = (np.array(high) / scale for scale, high in heights.items())
    assert len(small)
    np.testing.assert_allclose(small, large, rtol=1e-6)
    assert (small < 0.05 * lamp.radius).all()


def test_turned_and_moved_lights_go_along() -> None:
    light = Light("spot", np.array([1.0, 0, 0]), (1, 1, 1), np.array([1.0, 0, 0]))
    moved = light.moved(shift(z=5.0, scale=2.0) @ turn("z", np.pi / 2))
    np.testing.assert_allclose(moved.at, [0, 2, 5], atol=1e-12)
    assert moved.aim is not None
    np.testing.assert_allclose(moved.aim / np.linalg.norm(moved.aim), [0, 1, 0], atol=1e-12)


def test_textures_are_named_by_what_they_show() -> None:
    one, two = textures.stripes(Draw(1)), textures.stripes(Draw(2))
    assert textures.bitmap(one)[1].keys() == textures.bitmap(one.copy())[1].keys()
    assert textures.bitmap(one)[1].keys() != textures.bitmap(two)[1].keys()
    assert textures.holes(Draw(3)).min() == 0
    assert textures.holes(Draw(3)).max() == 255
