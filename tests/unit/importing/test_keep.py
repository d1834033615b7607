"""Parts that are kept out of the networks: found or named, and then in every file of the lamp."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_examples.luminaires.lamp_scene import Material, Part, write_scene
from purelight_examples.luminaires.parts import tube
from purelight_train import cli
from purelight_train.presets import PRESETS
from tests.support import tiny

BLACK = Material("diffuse", {}, {"reflectance": (0.05, 0.05, 0.05)})
STEEL = Material("roughconductor", {"material": "Cr", "alpha": 0.2}, {})
AWAY = ["cable", "rose"]


def pendant() -> list[Part]:
    """An opaque ball that shines on a long cable, under a rose; with a ring close about it."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    ring = trimesh.creation.annulus(0.051, 0.056, 0.01, sections=24)
    rose = trimesh.creation.cylinder(0.04, 0.02, sections=24)
    rose.apply_translation((0, 0, 0.6))
    cable = tube([[0.0, 0.0, 0.05], [0.0, 0.0, 0.6]], 0.003, sides=8)
    return [
        Part("ball", ball, BLACK, (3.0, 2.0, 1.0)),
        Part("ring", ring, STEEL),
        Part("cable", cable, BLACK),
        Part("rose", rose, STEEL),
    ]


@pytest.fixture
def scene(mitsuba: Any, tmp_path: Path) -> Path:
    return write_scene(tmp_path / "lamps", "pendant", pendant())


@pytest.fixture
def train(mitsuba: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setitem(PRESETS, "draft", replace(tiny.TINY, paths=1 << 16))

    def run(*arguments: str) -> int:
        words = ["--device", "cpu", "--no-report", "--no-verdict", "--anchor", "none"]
        return cli.main([*arguments, *words])

    return run


def test_what_is_away_from_the_light_is_found(mitsuba: Any, scene: Path) -> None:
    """Not what lies close about the light, nor what gets much of it."""
    import mitsuba as mi

    from purelight_train.light.kept import parts_away

    assert parts_away(mi.load_file(str(scene), optimize=False)) == AWAY
    assert parts_away(mi.load_string(tiny.LAMP, optimize=False)) == []


def test_a_lit_table_is_not_away_from_the_light(mitsuba: Any, tmp_path: Path) -> None:
    import mitsuba as mi
    import trimesh

    from purelight_train.light.kept import parts_away

    table = trimesh.creation.cylinder(0.5, 0.01, sections=24)
    table.apply_translation((0, 0, -0.2))
    path = write_scene(tmp_path, "table", [*pendant(), Part("table", table, BLACK)])
    assert "table" not in parts_away(mi.load_file(str(path), optimize=False))


def test_a_name_is_needed_for_purelight_import(
    scene: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from purelight_import.cli import main

    words = [str(scene), "--output", str(tmp_path / "out"), "--keep", "auto", "--no-picture"]
    assert main(words) == 2
    assert "purelight-train" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_part_that_is_kept_no_longer_shines_and_that_is_said(
    mitsuba: Any, tmp_path: Path
) -> None:
    from purelight_import import Options
    from purelight_import.importing import import_lamp

    parts = [*pendant(), replace(pendant()[0], name="second")]
    path = write_scene(tmp_path / "two", "two", parts)
    made = import_lamp(path, tmp_path / "out", Options(keep=("second",)), picture=False)
    assert any("second" in note and "dark there" in note for note in made.notes)


@pytest.fixture
def kept(mitsuba: Any, scene: Path, tmp_path: Path) -> Path:
    """`kept.xml` of the pendant, as training finds it."""
    from purelight_import import Options
    from purelight_train.foreign import scene_of
    from purelight_train.fragment import kept_beside

    with scene_of(scene, tmp_path / "run", Options(keep=("auto",))) as lamp:
        found = kept_beside(lamp.scene)
        assert found is not None
        assert kept_beside(scene) is None
        (tmp_path / "run" / "config.json").touch()
    return found


def test_kept_parts_are_in_the_asset(kept: Path) -> None:
    from pxr import Usd, UsdGeom, UsdShade

    from purelight_format.usd.appearance_text import kept_texts
    from purelight_train.light.kept import kept_parts

    text = kept_texts(kept_parts(kept), "/lamp")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Xform "lamp" {{{text}}}')
    scope = stage.GetPrimAtPath("/lamp/kept")
    meshes = [p for p in scope.GetChildren() if p.IsA(UsdGeom.Mesh)]
    assert sorted(p.GetDisplayName() for p in meshes) == AWAY
    bounds = UsdGeom.BBoxCache(0, ["default", "render"]).ComputeWorldBound(scope)
    assert bounds.ComputeAlignedRange().GetMax()[2] == pytest.approx(0.61, abs=1e-3)
    for prim in meshes:
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        assert material.ComputeSurfaceSource()[0]


def test_a_fragment_stands_where_the_lamp_does(kept: Path, tmp_path: Path) -> None:
    """Fragments of two lamps in one room do not share names."""
    import mitsuba as mi

    from purelight_train.fragment import write_fragment

    for name in ("one", "two"):
        write_fragment(kept, tmp_path / f"{name}.kept.xml")
    place = "2 0 0 1  0 2 0 0  0 0 2 0.5  0 0 0 1"
    room = tmp_path / "room.xml"
    room.write_text(f"""<scene version="3.0.0"><default name="lamp_at" value="{place}"/>
        <include filename="one.kept.xml"/><include filename="two.kept.xml"/></scene>""")
    loaded = mi.load_file(str(room), optimize=False)
    assert len(loaded.shapes()) == 4
    assert np.array(loaded.bbox().max)[2] == pytest.approx(0.5 + 2 * 0.61, abs=1e-3)
    assert np.array(loaded.bbox().center())[0] == pytest.approx(1, abs=1e-3)


@pytest.mark.slow
def test_from_keep_to_export(
    train: Any, scene: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from pxr import Usd

    from purelight_export.cli import main as export
    from purelight_format.bundle import Bundle
    from purelight_format.summary import summary_text

    run, bundle = tmp_path / "run", tmp_path / "pendant.plux"
    assert train(str(scene), "--output", str(run), "--keep", "auto") == 0
    assert "--keep auto: cable, rose:" in capfd.readouterr().err
    assert export([str(run), "--output", str(bundle)]) == 0
    assert "pendant.kept.xml" in capfd.readouterr().out
    assert Bundle.open(bundle).manifest.bounding_sphere.radius < 0.1
    assert "finishes      ball_material (opaque), ring_material (metal)" in summary_text(
        Bundle.open(bundle)
    )
    stage = Usd.Stage.Open(str(bundle.with_suffix(".usda")))
    scope = stage.GetDefaultPrim().GetPath().AppendChild("kept")
    assert stage.GetPrimAtPath(scope).GetChildren()
