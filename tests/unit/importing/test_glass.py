"""Glass as bodies and sheets, turned the right way round."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material, Verbatim
from purelight_import.model.mesh import Mesh
from purelight_import.parts.glass import settled
from purelight_import.parts.hull import hull
from tests.support.lamp_files import model

GLASS = Material("Glass", (1.0, 1.0, 1.0), 0.0, 0.0, transmission=1.0)
THIN = Material("Sheet", (1.0, 1.0, 1.0), 0.0, 0.0, transmission=1.0, thin_walled=True)


def part(name: str, made: trimesh.Trimesh, material: Material = GLASS) -> Part:
    return Part(name, Mesh(np.array(made.vertices), np.array(made.faces, np.uint32)), material)


def moved(made: trimesh.Trimesh, x: float) -> trimesh.Trimesh:
    made.apply_translation([x, 0, 0])
    return made


def settle(*parts: Part, **wanted: str) -> tuple[dict[str, Part], str]:
    lamp = settled(Lamp("lamp", parts), wanted)
    return {p.name: p for p in lamp.parts}, "\n".join(lamp.notes.lines())


def test_closed_glass_is_a_body_and_open_glass_a_sheet() -> None:
    cut = model.ball(0.05)
    cut.update_faces(cut.triangles_center[:, 2] < 0.03)
    found, notes = settle(part("Ball", model.ball(0.01)), part("Cup", moved(cut, 1)))
    assert found["Ball"].solid
    assert not found["Cup"].solid
    assert "open edges" in notes
    assert "Cup" in notes


def test_seams_are_no_edges() -> None:
    """Corners at one place are one, though a file gives each face corners of its own."""
    made = model.ball(0.05)
    faces = np.arange(3 * len(made.faces)).reshape(-1, 3)
    apart = trimesh.Trimesh(made.triangles.reshape(-1, 3), faces, process=False)
    assert settle(part("Ball", apart))[0]["Ball"].solid


def test_what_the_file_calls_thin_is_thin_unless_one_says_otherwise() -> None:
    found, notes = settle(part("Ball", model.ball(0.05), THIN))
    assert not found["Ball"].solid
    assert "--glass" in notes
    assert settle(part("Ball", model.ball(0.05), THIN), ball="solid")[0]["Ball"].solid
    assert not settle(part("Ball", model.ball(0.05)), **{"gl*": "thin"})[0]["Ball"].solid


def test_one_surface_around_a_bulb_is_a_shell() -> None:
    bulb = part("Bulb", model.ball(0.01), Material("Glow"))
    found, notes = settle(part("Globe", model.ball(0.05)), bulb)
    assert not found["Globe"].solid
    assert "thin shell" in notes
    walled, notes = settle(part("Globe", model.shell()), bulb)
    assert walled["Globe"].solid
    assert notes == ""


def test_a_name_that_all_parts_have_is_first_that_of_one() -> None:
    """A node `lamp` about a material `lamp`: the other parts become no glass."""
    globe = part("Globe", model.ball(0.05), Material("lamp"))
    base = part("Base", moved(model.ball(0.01), 1), Material("Paint"))
    below = [replace(p, path=("lamp",)) for p in (globe, base)]
    found, _ = settle(*below, lamp="thin")
    assert [found[n].material.glass for n in ("Globe", "Base")] == [True, False]


def test_wanted_glass_is_made_of_any_material() -> None:
    """A globe that its artist drew with alpha; Mitsuba's own materials stay. What is metal by its
    file is no glass, and becomes it too."""
    drawn = Material("Drawn", (0.9, 1.0, 0.9), 1.0, 0.0, transmission=0.8, opacity=0.2)
    assert not drawn.glass
    own = part("Own", moved(model.ball(0.01), 1), Verbatim("bsdf", ()))
    found, notes = settle(part("Globe", model.ball(0.05), drawn), own, globe="thin", own="solid")
    made = found["Globe"].material
    assert isinstance(made, Material)
    assert (made.base_color, made.transmission, made.opacity, made.metalness) == (
        (0.9, 1.0, 0.9), 1.0, 1.0, 0.0,
    )  # fmt: skip
    assert not found["Globe"].solid
    assert "made glass by --glass (Globe)" in notes
    assert "--glass changes no material that Mitsuba wrote itself (Own)" in notes


def inverted(made: trimesh.Trimesh) -> trimesh.Trimesh:
    copy = made.copy()
    copy.invert()
    return copy


@pytest.mark.parametrize(
    ("made", "turns"),
    [
        (model.shell, False),
        (lambda: inverted(model.shell()), True),
        (lambda: trimesh.util.concatenate([model.ball(0.06), model.ball(0.055)]), True),
        (lambda: trimesh.util.concatenate([model.ball(0.01), moved(model.ball(0.01), 1)]), False),
    ],
)
def test_surfaces_face_away_from_the_glass(made: Any, turns: bool) -> None:
    """The outer surface of a wall faces out, the inner one into the hollow."""
    found, notes = settle(part("Globe", made()))
    mesh = found["Globe"].mesh
    volume = sorted(hull(mesh).volume)
    assert ("turned" in notes) == turns
    reference, _ = settle(part("Globe", model.shell()))
    if len({round(v, 9) for v in volume}) > 1:  # a wall, not two beads
        assert volume == pytest.approx(sorted(hull(reference["Globe"].mesh).volume))
        assert volume[0] < 0 < volume[1]
    else:
        assert min(volume) > 0


def test_walls_of_two_parts_face_away_too() -> None:
    inner = part("Inner", model.ball(0.055))
    found, notes = settle(part("Outer", model.ball(0.06)), inner)
    assert hull(found["Outer"].mesh).volume[0] > 0 > hull(found["Inner"].mesh).volume[0]
    assert "Inner" in notes


def test_faces_that_look_to_different_sides_are_mended() -> None:
    made = model.ball(0.05)
    made.faces[::3] = made.faces[::3, ::-1]
    found, notes = settle(part("Ball", made))
    assert found["Ball"].solid
    assert hull(found["Ball"].mesh).volume[0] == pytest.approx(model.ball(0.05).volume)
    assert "consistent" in notes
