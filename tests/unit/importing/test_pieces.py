"""Parts taken apart into the pieces that do not touch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from purelight_format.errors import PureLightError
from purelight_import import Options
from purelight_import.importing import lamp_lit, read_lamp
from purelight_import.model import limits
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.mesh import Mesh
from purelight_import.parts import pieces
from purelight_import.parts.pieces import taken_apart
from tests.support.lamp_files import glb, model
from tests.support.lamp_files.model import Piece

PAINT = Material("paint")


def balls(radii: list[float]) -> trimesh.Trimesh:
    """Side by side, in one mesh."""
    made = [model.ball(radius, 1) for radius in radii]
    for number, ball in enumerate(made):
        ball.apply_translation((number, 0.0, 0.0))
    return trimesh.util.concatenate(made)


def lamp(*parts: tuple[str, trimesh.Trimesh], **more: Any) -> Lamp:
    return Lamp("lamp", tuple(
        Part(name, Mesh(np.array(m.vertices), np.array(m.faces, np.uint32)), PAINT, **more)
        for name, m in parts
    ))  # fmt: skip


def widths(made: Lamp) -> dict[str, float]:
    return {p.name: float(np.ptp(p.mesh.bounds, axis=0)[2]) for p in made.parts}


def test_pieces_are_parts_the_largest_first() -> None:
    whole = lamp(("all", balls([0.1, 0.3, 0.2])), ("Rest", model.ball(0.5)))
    made = taken_apart(whole, ["ALL"])
    found = widths(made)
    assert list(found) == ["all.1", "all.2", "all.3", "Rest"]
    np.testing.assert_allclose(list(found.values()), [0.6, 0.4, 0.2, 1.0], rtol=1e-6)
    assert sum(p.mesh.area for p in made.parts) == pytest.approx(
        sum(p.mesh.area for p in whole.parts)
    )
    assert made.notes.lines() == ["taken apart by --pieces (all: 3)"]


def test_vertices_keep_what_they_have() -> None:
    """Seams of textures part vertices and no piece."""
    mesh = balls([0.1, 0.2])
    corners = np.array(mesh.triangles, np.float64).reshape(-1, 3)  # each triangle its own vertices
    faces = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
    soup = Mesh(corners, faces, corners / np.linalg.norm(corners, axis=1)[:, None], corners[:, :2])
    made = taken_apart(Lamp("lamp", (Part("all", soup, PAINT),)), ["*"])
    assert len(made.parts) == 2
    for part in made.parts:
        own, normals, uv = part.mesh.positions, part.mesh.normals, part.mesh.uv
        assert normals is not None
        assert uv is not None
        np.testing.assert_allclose(normals, own / np.linalg.norm(own, axis=1)[:, None])
        np.testing.assert_allclose(uv, own[:, :2])


def test_the_old_name_means_all_pieces() -> None:
    made = taken_apart(lamp(("all", balls([0.1, 0.2])), ("rest", model.ball(0.5))), ["all"])
    lit = lamp_lit(made, Options(emitters=("all=806lm",)))
    assert [p.name for p in lit.parts if p.radiance is not None] == ["all.1", "all.2"]
    lit = lamp_lit(made, Options(emitters=("all.2=806lm",)))
    assert [p.name for p in lit.parts if p.radiance is not None] == ["all.2"]


def test_names_are_new_and_short() -> None:
    long = "x" * limits.NAME
    made = taken_apart(
        lamp(("a", balls([0.1, 0.2])), ("A.1", model.ball(0.5)), (long, balls([0.1, 0.2]))), ["*"]
    )
    names = [p.name for p in made.parts]
    assert len({name.lower() for name in names}) == len(names) == 5
    assert max(map(len, names)) <= limits.NAME
    assert "--pieces leaves what is one piece (A.1)" in made.notes.lines()


def test_many_small_ones_stay_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pieces, "ALONE", 3)
    made = taken_apart(lamp(("all", balls([0.1, 0.2, 0.3, 0.4, 0.05]))), ["all"])
    assert len(made.parts) == 4
    assert made.parts[3].mesh.area == pytest.approx(balls([0.1, 0.05]).area)
    monkeypatch.setattr(limits, "PARTS", 3)
    with pytest.raises(PureLightError, match="more than 3 pieces"):
        taken_apart(lamp(("all", balls([0.1, 0.2, 0.3, 0.4, 0.05]))), ["all"])


@pytest.fixture
def merged(tmp_path: Path) -> Path:
    """A lamp as one mesh of one material."""
    bulb, base = model.bulb().mesh, model.base()
    return glb.write(
        tmp_path, [Piece("Low", trimesh.util.concatenate([bulb, base.mesh]), "Atlas", base.words)]
    )


def test_what_to_do_is_said_where_nothing_emits(merged: Path, fault: Any) -> None:
    assert "'Low' is 2 pieces that do not touch: --pieces 'Low' parts them" in fault(merged)
    said = fault(merged, "--pieces", "Low")
    assert "there are Low.1 (50 mm), Low.2 (40 mm)" in said
    assert "do not touch" not in said


def test_a_name_that_says_light_is_no_bulb(tmp_path: Path, fault: Any) -> None:
    both = trimesh.util.concatenate([model.bulb().mesh, model.base().mesh])
    file = glb.write(tmp_path, [Piece("Light", both, "Atlas", model.base().words)])
    assert "--pieces 'Light' parts them" in fault(file)


def test_what_to_do_is_said_where_all_emits(merged: Path) -> None:
    lit, _ = read_lamp(merged, Options(emitters=("Low=806lm",)))
    assert any(line.startswith("all of the lamp emits; 'Low' is 2") for line in lit.notes.lines())
    lit, _ = read_lamp(merged, Options(pieces=("low",), emitters=("low.2=806lm",)))
    assert not any("all of the lamp" in line for line in lit.notes.lines())
    shines = {p.name: p.radiance is not None for p in lit.parts}
    assert shines == {"Low.1": False, "Low.2": True}


def test_pieces_can_be_left_out_and_made_glass(merged: Path) -> None:
    options = Options(pieces=("*",), emitters=("low.2",), glass=("low.1=thin",))
    lit, _ = read_lamp(merged, options)
    glass = [p.name for p in lit.parts if isinstance(p.material, Material) and p.material.glass]
    assert glass == ["Low.1"]
    lit, kept = read_lamp(merged, Options(pieces=("*",), emitters=("low.2",), keep=("low.1",)))
    assert [[p.name for p in parts] for parts in (lit.parts, kept)] == [["Low.2"], ["Low.1"]]
