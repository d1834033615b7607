"""Lamps as an artist handles them: imported, copied, renamed, saved, opened elsewhere, damaged."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_blender import looks_text
from purelight_format.photometry.table import IntensityTable
from purelight_format.photometry.writer import ies_text
from tests.assets import bad
from tests.support import analytic_lamps, blender_lamps, lamp
from tests.support.analytic_lamps import CENTRE, RADIUS
from tests.support.blender_host import Blender
from tests.unit.blender.conftest import pixels

DAMAGED = (
    "PLX_ZIP_CRC", "PLX_ZIP_TRUNCATED", "PLX_JSON_SYNTAX", "PLX_MANIFEST_DIGEST_MISMATCH",
    "PLX_ONNX_PARSE", "PLX_ONNX_COST", "PLX_ONNX_OP_NOT_ALLOWED", "PLX_GOLDEN_MISMATCH",
    "PLX_SURFACE_INDEX", "PLX_NPY_HEADER", "PLX_USD_NOT_ALLOWED",
)  # fmt: skip


def camera(z: float = 3.0) -> list[list[float]]:
    seen = np.eye(4)
    seen[:3, 3] = *CENTRE[:2], z
    return [[float(x) for x in row] for row in seen]


def shot(path: Path, **more: Any) -> tuple[str, dict[str, Any]]:
    asked = {"path": str(path), "camera": camera(), "size": 0.6, "pixels": 16} | more
    return "picture", asked


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return blender_lamps.glass_ball().write(tmp_path_factory.mktemp("ball") / "ball.plux")


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lamp whose tables are too large for the shader's text."""
    return blender_lamps.gridded().write(tmp_path_factory.mktemp("grid") / "grid.plux")


def test_a_damaged_file_is_one_line_and_leaves_nothing(blender: Blender, tmp_path: Path) -> None:
    asked: list[Any] = [("empty", {}), ("counts", {})]
    codes = [code for code in DAMAGED if code in bad.ASSETS]
    assert len(codes) >= 7
    for code in codes:
        path = tmp_path / f"{code}.plux"
        path.write_bytes(bad.ASSETS[code][0]())
        asked += [("plux", {"path": str(path)}), ("counts", {})]
    asked += [("plux", {"path": str(tmp_path / "nowhere.plux")}), ("counts", {})]
    _, before, *found = blender.run(*asked)
    for code, (said,), after in zip([*codes, "nowhere"], found[::2], found[1::2], strict=True):
        (line,) = said.strip().splitlines()
        assert line.startswith("Error: ")
        assert code in line
        assert "Traceback" not in line
        assert after == before


def test_one_bad_lamp_of_several_means_none(blender: Blender, ball: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.plux").write_bytes(bad.ASSETS["PLX_ONNX_PARSE"][0]())
    shutil.copy(ball, tmp_path / "good.plux")
    names = [{"name": "good.plux"}, {"name": "bad.plux"}]
    folder = {"path": "", "files": names, "directory": str(tmp_path)}
    _, said, after, again, both = blender.run(
        ("empty", {}), ("plux", folder), ("counts", {}),
        ("plux", folder | {"files": names[:1] * 2}), ("counts", {}),
    )  # fmt: skip
    assert "bad.plux" in said[0]
    assert not any(after.values())
    assert again == ["FINISHED"]
    assert (both["objects"], both["meshes"]) == (2, 1)


def test_copies_share_mesh_and_materials_and_have_dimmers_of_their_own(
    blender: Blender, ball: Path, tmp_path: Path
) -> None:
    """Also as instances of a collection, whose empties have the dimmers."""
    pictures = [tmp_path / f"{k}.exr" for k in range(4)]
    results = blender.run(
        ("empty", {}), ("plux", {"path": str(ball)}), shot(pictures[0]),
        ("dim", {"name": "ball", "dimmer": 0.25, "tint": [1, 0, 0.5]}), shot(pictures[1]),
        ("plux", {"path": str(ball)}), ("counts", {}),
        ("dim", {"name": "ball.001", "dimmer": 0.0}),
        ("collected", {"name": "ball", "empty": "hung", "location": [0, 0, 0]}),
        ("place", {"name": "ball.001", "world": np.diag([1.0, 1, 1, 1]).tolist()}),
        ("dim", {"name": "ball", "dimmer": 0.5}),
        ("drop", {"name": "ball.001"}), shot(pictures[2]),
        ("dim", {"name": "hung", "dimmer": 0.125}), shot(pictures[3]),
    )  # fmt: skip
    counts = results[6]
    assert (counts["objects"], counts["meshes"], counts["materials"]) == (2, 1, 1)
    full, red, half, eighth = (pixels(path) for path in pictures)
    assert full.max() > 1
    assert np.allclose(red, full * [0.25, 0, 0.125], rtol=1e-4, atol=1e-6)
    assert np.allclose(half, 0.5 * full, rtol=1e-4, atol=1e-6)
    assert np.allclose(eighth, 0.125 * full, rtol=1e-4, atol=1e-6)


def test_a_saved_file_is_whole_by_itself(blender: Blender, learned: Path, tmp_path: Path) -> None:
    """Saved under a strange name, opened by another process: renamed, the lamp and tables gone."""
    folder = tmp_path / "Häuser & Lampen"
    folder.mkdir()
    file, given = folder / "Wohnzimmer 1.blend", folder / "Größe 1 (neu).plux"
    shutil.copy(learned, given)
    before, after = tmp_path / "before.exr", tmp_path / "after.exr"
    _, said, _, paths, *_ = blender.run(
        ("empty", {}), ("plux", {"path": str(given)}), shot(before), ("tables", {}),
        ("rename", {}), ("save", {"path": str(file)}),
    )  # fmt: skip
    assert said == ["FINISHED"]
    (table,) = map(Path, paths)
    assert table.is_file()
    assert blender.folder in table.parents
    given.unlink()
    table.unlink()
    _, found, *_ = blender.run(("load", {"path": str(file)}), ("tables", {}), shot(after))
    assert found == [str(table)]
    assert table.is_file()
    assert pixels(before).max() > 0.5
    assert np.array_equal(pixels(before), pixels(after))


def test_a_table_that_was_cut_off_is_written_anew(
    blender: Blender, learned: Path, tmp_path: Path
) -> None:
    one, two = tmp_path / "one.exr", tmp_path / "two.exr"
    _, _, _, (path,) = blender.run(
        ("empty", {}), ("plux", {"path": str(learned)}), shot(one), ("tables", {})
    )
    Path(path).write_bytes(Path(path).read_bytes()[:100])
    blender.run(("empty", {}), ("plux", {"path": str(learned)}), shot(two))
    assert np.array_equal(pixels(one), pixels(two))


def test_where_no_osl_runs_the_user_is_told_and_the_light_stays(
    blender: Blender, tmp_path: Path
) -> None:
    """EEVEE at import; Cycles without OSL has the same light within the look's own error."""
    given = analytic_lamps.ball()
    photometry = {"photometry.ies": analytic_lamps.photometry(given, 0.0)}
    path = given.write(tmp_path / "even.plux", photometry)
    floor = ("floor", {"z": CENTRE[2] - 10 * RADIUS, "size": 4})
    seen = {"size": 2, "pixels": 4, "samples": 1024}
    seen["camera"] = camera(CENTRE[2] - 9.9 * RADIUS)
    exact, simple = tmp_path / "exact.exr", tmp_path / "simple.exr"
    _, said, before, _, _, _, _, things = blender.run(
        ("empty", {"engine": "BLENDER_EEVEE"}), ("plux", {"path": str(path)}),
        ("objects", {}), floor, ("engine", {"name": "CYCLES"}), ("objects", {}),
        shot(exact, **seen), ("objects", {}),
    )  # fmt: skip
    assert said == ["FINISHED"]
    told = [line for line in blender.said() if line.startswith("Warning: even: ")]
    assert len(told) == 1
    assert looks_text.NOTE in told[0]
    assert "choose Cycles" in told[0]
    assert [thing["state"] for thing in before if thing["type"] == "MESH"] == ["simple"]
    assert [thing["type"] for thing in before] == ["MESH", "LIGHT"]
    assert not before[0]["shadow"]
    assert not [t for t in things if t["type"] == "LIGHT"]
    assert things[0]["shadow"]
    blender.run(
        ("empty", {}), ("plux", {"path": str(path)}), floor, shot(simple, osl=False, **seen)
    )
    ratio = pixels(simple) / pixels(exact)
    assert np.isclose(ratio.mean(), 1, atol=0.02), ratio


def test_the_stand_in_has_the_shape_of_the_photometry_and_follows_dimmer_and_scale(
    blender: Blender, tmp_path: Path
) -> None:
    given = analytic_lamps.ball()
    photometry = {"photometry.ies": analytic_lamps.photometry(given, 2.0)}
    path = given.write(tmp_path / "down.plux", photometry)
    seen = {"size": 0.2, "pixels": 2, "samples": 256, "osl": False}
    seen["camera"] = camera(CENTRE[2] - 9.9 * RADIUS)
    pictures = [tmp_path / f"{k}.exr" for k in range(2)]
    twice = np.diag([2.0, 2, 2, 1])
    twice[:3, 3] = -np.array(CENTRE)
    blender.run(
        ("empty", {}), ("plux", {"path": str(path)}),
        ("floor", {"z": CENTRE[2] - 10 * RADIUS, "size": 4}), shot(pictures[0], **seen),
        ("place", {"name": "down", "world": twice.tolist()}),
        ("dim", {"name": "down", "dimmer": 0.5}), shot(pictures[1], **seen),
    )  # fmt: skip
    intensity = given.flux * 3 / (2 * np.pi)  # Of flux * (n + 1) / 2 pi downwards, n = 2.
    expected = 0.5 / np.pi * intensity / (10 * RADIUS) ** 2
    assert np.allclose(pixels(pictures[0]).mean((0, 1)), expected, rtol=0.03)
    assert np.allclose(pixels(pictures[1]), 2 * pixels(pictures[0]), rtol=0.05)


def test_the_stand_in_shines_to_the_side_of_the_photometry(
    blender: Blender, tmp_path: Path
) -> None:
    """Cycles counts horizontal angles from another axis, and the other way round."""
    vertical, horizontal = np.linspace(0, 180, 37), np.linspace(0, 360, 25)
    aside = np.cos(np.radians(horizontal[:, None] - 30)) * np.sin(np.radians(vertical))
    table = IntensityTable(vertical, horizontal, 10 * (1 + aside))
    words = {"TEST": "t", "TESTLAB": "t", "ISSUEDATE": "2020-01-01", "MANUFAC": "t"}
    photometry = {"photometry.ies": ies_text(table, words, radius=0.0, watts=1.0)}
    path = analytic_lamps.ball().write(tmp_path / "aside.plux", photometry)
    picture, height, size = tmp_path / "floor.exr", CENTRE[2] - 10 * RADIUS, 6.0
    blender.run(
        ("empty", {}), ("plux", {"path": str(path)}), ("floor", {"z": height, "size": 8}),
        shot(picture, size=size, samples=256, osl=False, camera=camera(height + 0.1)),
    )  # fmt: skip
    seen = pixels(picture).mean(-1)
    along = ((np.arange(16) + 0.5) / 16 - 0.5) * size
    x, y = np.meshgrid(along, -along)
    ring = (np.hypot(x, y) > 1.2) & (np.hypot(x, y) < 2.8)
    towards = (seen[ring] * np.exp(1j * np.arctan2(y, x)[ring])).sum()
    assert np.degrees(np.angle(towards)) == pytest.approx(30, abs=3)


def test_metres_become_scene_units(blender: Blender, ball: Path) -> None:
    _, _, (thing,) = blender.run(
        ("empty", {"scale_length": 0.01}), ("plux", {"path": str(ball)}), ("objects", {})
    )
    assert np.allclose(thing["size"], 200 * RADIUS, rtol=0.02)


def test_an_import_is_undone_and_done_again(blender: Blender, ball: Path, tmp_path: Path) -> None:
    asked = ("undo_and_redo", {"path": str(ball)}), shot(tmp_path / "again.exr")
    _, found, _ = blender.run(("empty", {}), *asked)
    assert found == [0, 1, 0, 1]
    assert pixels(tmp_path / "again.exr").max() > 1


def test_switched_off_it_leaves_nothing_behind(blender: Blender) -> None:
    assert blender.run(("empty", {}), ("disable", {}))[1] == []


def test_the_octahedron_of_all_networks_is_imported(blender: Blender, tmp_path: Path) -> None:
    path = tmp_path / "lamp.plux"
    path.write_bytes(lamp.seal(lamp.good()))
    assert blender.run(("empty", {}), ("plux", {"path": str(path)}))[1] == ["FINISHED"]


def test_a_path_may_begin_at_the_blend_file(blender: Blender, ball: Path, tmp_path: Path) -> None:
    shutil.copy(ball, tmp_path / "ball.plux")
    one, more = {"path": "//ball.plux"}, [{"name": "ball.plux"}]
    *_, first, second, _ = blender.run(
        ("empty", {}), ("save", {"path": str(tmp_path / "room.blend")}), ("plux", one),
        ("plux", {"path": "", "files": more, "directory": "//"}), ("counts", {}),
    )  # fmt: skip
    assert first == second == ["FINISHED"]


def test_a_strangers_file_names_no_place_to_write_to(
    blender: Blender, learned: Path, tmp_path: Path
) -> None:
    file, planted = tmp_path / "room.blend", tmp_path / "planted"
    blender.run(
        ("empty", {}), ("plux", {"path": str(learned)}),
        ("forged", {"key": "../" * 30 + str(planted)[1:], "table": ""}),
        ("save", {"path": str(file)}),
    )  # fmt: skip
    _, (said,) = blender.run(("load", {"path": str(file)}), ("refresh", {}))
    assert "import the lamp again" in said
    assert not planted.with_suffix(".exr").exists()


def test_a_linked_lamp_finds_its_tables(blender: Blender, learned: Path, tmp_path: Path) -> None:
    """Of a file that was saved on another computer."""
    file, room, seen = (tmp_path / name for name in ("lamp.blend", "room.blend", "seen.exr"))
    _, _, (table,), *_ = blender.run(
        ("empty", {}), ("plux", {"path": str(learned)}), ("tables", {}),
        ("forged", {"key": "", "table": "/elsewhere/gone.exr"}), ("save", {"path": str(file)}),
        ("empty", {}), ("linked", {"path": str(file), "name": "grid"}),
        ("save", {"path": str(room)}),
    )  # fmt: skip
    _, found, _ = blender.run(("load", {"path": str(room)}), ("tables", {}), shot(seen))
    assert found == [table]
    assert pixels(seen).max() > 0.5


def test_a_lamp_deep_in_collections_has_the_look_of_the_renderer(
    blender: Blender, ball: Path
) -> None:
    *_, before, _, _, after = blender.run(
        ("empty", {}), ("plux", {"path": str(ball)}),
        ("collected", {"name": "ball", "empty": "inner", "location": [0, 0, 0]}),
        ("collected", {"name": "inner", "empty": "outer", "location": [0, 0, 0]}),
        ("objects", {}), ("engine", {"name": "BLENDER_EEVEE"}), ("refresh", {}), ("objects", {}),
    )  # fmt: skip
    states = [[t["state"] for t in things if t["type"] == "MESH"] for things in (before, after)]
    assert states == [["networks"], ["simple"]]
    assert [thing["type"] for thing in after].count("LIGHT") == 1


def test_the_stand_in_follows_the_scale_of_what_the_lamp_hangs_on(
    blender: Blender, ball: Path
) -> None:
    *_, before, _, after = blender.run(
        ("empty", {"engine": "BLENDER_EEVEE"}), ("plux", {"path": str(ball)}), ("objects", {}),
        ("adopted", {"name": "ball", "scale": 3.0}), ("objects", {}),
    )  # fmt: skip
    once, nine = ([t["energy"] for t in things if t["energy"]] for things in (before, after))
    assert nine == pytest.approx([9 * once[0]])


def test_the_stand_in_of_a_black_lamp_is_black(blender: Blender, tmp_path: Path) -> None:
    lit = blender_lamps.glass_ball()
    dark = replace(lit.surface, triangle_flux=0 * lit.surface.triangle_flux)
    path = replace(lit, surface=dark, flux=np.zeros(3)).write(tmp_path / "black.plux")
    *_, things = blender.run(
        ("empty", {"engine": "BLENDER_EEVEE"}), ("plux", {"path": str(path)}), ("objects", {})
    )
    (light,) = (thing for thing in things if thing["type"] == "LIGHT")
    assert light["energy"] == 0
    assert light["color"] == [0, 0, 0]
