"""OBJ: groups, odd faces, missing libraries, and materials of several dialects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.formats import read
from purelight_import.importing import import_lamp, read_lamp
from purelight_import.model.lamp import Part
from purelight_import.model.material import Material
from purelight_import.model.picture import Picture
from purelight_import.options import Options

MAPS = ("map_Ke", "map_Kd", "map_d", "norm")
VERTICES = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 1.5 0\n"


def parts(folder: Path, text: str, mtl: str | None = None) -> dict[str, Part]:
    if mtl is not None:
        (folder / "lamp.mtl").write_text(mtl)
        text = f"mtllib lamp.mtl\n{text}"
    (folder / "lamp.obj").write_text(text)
    return {part.name: part for part in read(folder / "lamp.obj").parts}


def material(folder: Path, mtl: str) -> Material:
    (part,) = parts(folder, f"{VERTICES}usemtl M\nf 1 2 3", f"newmtl M\n{mtl}").values()
    assert isinstance(part.material, Material)
    return part.material


def test_objects_groups_and_materials_are_parts(tmp_path: Path) -> None:
    text = f"{VERTICES}o Shade\nusemtl A\nf 1 2 3\nusemtl B\nf 1 3 4\no Foot\ng Ring\nf 1 2 3 4\n"
    found = parts(tmp_path, text)
    assert list(found) == ["Shade", "Shade_2", "Foot"]
    assert found["Foot"].names == ("Foot", "Foot", "Ring", "B")
    assert [p.material.name for p in found.values()] == ["A", "B", "B"]


def test_polygons_and_indices_counted_back(tmp_path: Path) -> None:
    (part,) = parts(tmp_path, f"{VERTICES}f -5 -4 -3 -1 -2\nv 9 9 9\n").values()
    assert part.mesh.area == pytest.approx(1.25)
    assert len(part.mesh.triangles) == 3
    assert (part.mesh.cross[:, 2] > 0).all()


@pytest.mark.parametrize("first", range(8))
@pytest.mark.parametrize("turned", [1, -1])
def test_concave_polygons_are_filled_and_no_more(first: int, turned: int, tmp_path: Path) -> None:
    """A U, with texture coordinates that are its places."""
    at = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)][::turned]
    rows = "".join(f"v {x / 10} {y / 10} 0\nvt {x / 10} {y / 10}\n" for x, y in at)
    face = " ".join(f"{k}/{k}" for k in np.roll(np.arange(1, 9), first))
    (part,) = parts(tmp_path, f"{rows}f {face}\n").values()
    assert part.mesh.area == pytest.approx(0.07)
    assert (turned * part.mesh.cross[:, 2] > 0).all()
    assert part.mesh.uv is not None
    np.testing.assert_allclose(part.mesh.uv * [1, -1] + [0, 1], part.mesh.positions[:, :2])


def test_a_polygon_with_a_corner_that_is_no_number(tmp_path: Path) -> None:
    (part,) = parts(tmp_path, f"{VERTICES}v nan 0 0\nf 1 2 3 4\nf 1 2 6 5 4\n").values()
    assert 1 <= part.mesh.area <= 2


def test_texture_coordinates_and_normals_by_corner(tmp_path: Path) -> None:
    text = f"{VERTICES}vt 0 0\nvt 1 0.25\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\nf 1/2/1 3/1/1 4/1/1\n"
    (part,) = parts(tmp_path, text).values()
    mesh = part.mesh
    assert mesh.uv is not None
    assert len(mesh.positions) == 5  # the first vertex has two texture coordinates
    np.testing.assert_allclose(mesh.uv[mesh.triangles[0, 1]], [1, 0.75])  # from the upper edge
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, 1], (5, 1)))


def test_a_backslash_joins_lines(tmp_path: Path) -> None:
    (part,) = parts(tmp_path, f"{VERTICES}f 1 2 \\\n3 4 # a square\n").values()
    assert part.mesh.area == pytest.approx(1)


def test_a_missing_library_is_told(tmp_path: Path) -> None:
    (tmp_path / "lamp.obj").write_text(f"mtllib no such.mtl\n{VERTICES}usemtl Brass\nf 1 2 3")
    lamp = read(tmp_path / "lamp.obj")
    assert lamp.parts[0].material.name == "Brass"
    assert sum("missing" in line for line in lamp.notes.lines()) >= 1
    assert any("no library describes" in line and "Brass" in line for line in lamp.notes.lines())


def test_names_with_spaces(tmp_path: Path) -> None:
    (tmp_path / "my lamp.mtl").write_text("newmtl Clear Glass\nKd 0 0 0\nillum 7\nNi 1.4")
    text = f"mtllib my lamp.mtl\n{VERTICES}usemtl Clear Glass\nf 1 2 3"
    (tmp_path / "lamp.obj").write_text(text)
    found = read(tmp_path / "lamp.obj").parts[0].material
    assert isinstance(found, Material)
    assert (found.name, found.transmission, found.ior) == ("Clear Glass", 1.0, 1.4)


@pytest.mark.parametrize(
    ("mtl", "through"),
    [
        ("illum 2\nd 1", 0.0), ("illum 2\nd 0.2", 1.0), ("illum 2\nTr 0.8", 1.0),
        ("illum 2\nd 0.7", 0.3), ("illum 6", 1.0), ("illum 7\nd 1", 1.0), ("illum 4\nd 1", 0.0),
        ("illum 4\nTf 0.9 0.9 1", 1.0),
    ],
)  # fmt: skip
def test_what_counts_as_glass(mtl: str, through: float, tmp_path: Path) -> None:
    assert material(tmp_path, mtl).transmission == pytest.approx(through)


def test_pbr_words_and_exponents(tmp_path: Path) -> None:
    found = material(tmp_path, "Kd 0.5 0.4 0.3\nPr 0.25\nPm 1\nPc 0.5")
    assert (found.roughness, found.metalness, found.coat) == (0.25, 1.0, 0.5)
    phong = material(tmp_path, "Kd 0.5 0.4 0.3\nKs 1 1 1\nNs 98")
    assert phong.roughness == pytest.approx((2 / 100) ** 0.25)
    assert material(tmp_path, "Kd 0.5 0.4 0.3\nKs 0 0 0\nNs 98").specular == 0
    mirror = material(tmp_path, "Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nNs 1000")
    assert (mirror.metalness, mirror.base_color) == (1.0, (0.9, 0.8, 0.7))


@pytest.mark.parametrize(("scale", "unit"), [(1, "m"), (30, "cm"), (500, "mm")])
def test_units_are_guessed_aloud(scale: float, unit: str, tmp_path: Path) -> None:
    rows = "".join(f"v {scale * x} {scale * y} 0\n" for x, y in ((0, 0), (1, 0), (1, 1)))
    (tmp_path / "lamp.obj").write_text(f"{rows}f 1 2 3")
    lamp, _ = read_lamp(tmp_path / "lamp.obj", Options(emitters=("*=10lm",)))
    assert any(f"taken as {unit}," in line for line in lamp.notes.lines())


def test_a_size_that_is_no_lamp_in_any_unit(tmp_path: Path, fault: Any) -> None:
    (tmp_path / "lamp.obj").write_text("v 0 0 0\nv 1e5 0 0\nv 0 1e5 0\nf 1 2 3")
    assert "--units" in fault(tmp_path / "lamp.obj")


@pytest.mark.parametrize("face", ["1 2 9", "0 1 2", "-9 1 2", "1 2 x", "1/9 2/9 3/nine"])
def test_faces_that_are_none(face: str, tmp_path: Path, fault: Any) -> None:
    (tmp_path / "lamp.obj").write_text(f"{VERTICES}f {face}\n")
    assert "broken" in fault(tmp_path / "lamp.obj", "--emitter", "*")


def test_a_texture_outside_is_told_and_not_read(tmp_path: Path) -> None:
    inner = tmp_path / "lamp"
    inner.mkdir()
    (tmp_path / "a.png").write_bytes(b"")
    (inner / "lamp.mtl").write_text("newmtl M\nmap_Kd -s 1 1 1 ../a.png")
    (inner / "lamp.obj").write_text(f"mtllib lamp.mtl\n{VERTICES}usemtl M\nf 1 2 3")
    assert any("outside" in line for line in read(inner / "lamp.obj").notes.lines())


@pytest.mark.parametrize("folder", ["C:\\My Lamps\\", "/home/me/lamps/", "../scenes/", "D:/"])
@pytest.mark.parametrize("below", ["", "textures/"])
def test_files_of_its_makers_disk_are_found_in_the_folder(
    folder: str, below: str, tmp_path: Path
) -> None:
    """Names are whole paths of another machine, of which the folder has the end."""
    (tmp_path / below).mkdir(exist_ok=True)
    Image.new("RGB", (1, 1), (255, 0, 0)).save(tmp_path / below / "red paint.png")
    name = folder + below + "red paint.png"
    (tmp_path / "lamp.mtl").write_text(f"newmtl M\nKd 1 1 1\nmap_Kd -s 1 1 1 {name}")
    (tmp_path / "lamp.obj").write_text(f"mtllib {folder}lamp.mtl\n{VERTICES}usemtl M\nf 1 2 3")
    lamp = read(tmp_path / "lamp.obj")
    (part,) = lamp.parts
    assert isinstance(part.material, Material)
    assert isinstance(part.material.base_color, Picture)
    np.testing.assert_allclose(part.material.base_color.mean(), [1, 0, 0], atol=1e-6)
    assert "lamp.mtl, red paint.png" in "".join(lamp.notes.lines())


@pytest.mark.parametrize("gap", ["  ", "\t", " \t "])
def test_any_blanks_follow_a_keyword(gap: str, tmp_path: Path) -> None:
    words = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "mtllib two.mtl", "o Shade", "usemtl A", "f 1 2 3"]
    (tmp_path / "two.mtl").write_text(f"newmtl{gap}A\nKd 0 0 0\nKe{gap}10 10 10")
    (tmp_path / "lamp.obj").write_text("\n".join(line.replace(" ", gap, 1) for line in words))
    (part,) = read(tmp_path / "lamp.obj").parts
    assert (part.name, part.material.name, part.radiance) == ("Shade", "A", (10, 10, 10))


RED, GREEN, BLUE, WHITE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)


@pytest.mark.parametrize(
    ("options", "u", "v", "wanted"),
    [
        ("", 0.25, 0.75, RED), ("-s 2 2 1", 0.3, 0.1, WHITE), ("-o 0.5 0 0", 0.25, 0.75, GREEN),
        ("-s 1 0.5 -o 0 0.5", 0.25, 0.25, RED), ("-s 0.5", 0.75, 0.25, BLUE),
        ("-clamp on -o 1 0", 0.25, 0.75, GREEN),
    ],
)  # fmt: skip
def test_textures_are_moved_and_sized(
    options: str, u: float, v: float, wanted: tuple[int, ...], tmp_path: Path
) -> None:
    """Coordinates are counted from the lower left corner."""
    quarters = 255 * np.array([[RED, GREEN], [BLUE, WHITE]], np.uint8)
    Image.fromarray(quarters).save(tmp_path / "glow.png")
    mtl = f"newmtl M\nKd 0 0 0\nKe 1 1 1\nmap_Ke {options} glow.png"
    (part,) = parts(tmp_path, f"{VERTICES}usemtl M\nf 1 2 3", mtl).values()
    assert isinstance(part.radiance, Picture)
    np.testing.assert_allclose(part.radiance.at(np.array([[u, 1 - v]])), [wanted])


def test_coordinates_beyond_any_lamp(tmp_path: Path, fault: Any) -> None:
    for far in ("1e200", "1e30"):
        (tmp_path / "lamp.obj").write_text(f"v 0 0 0\nv {far} 0 0\nv 0 {far} 0\nf 1 2 3")
        assert "mend the file" in fault(tmp_path / "lamp.obj", "--units", "m", "--emitter", "*")


def test_pictures_that_nothing_places_are_their_means(tmp_path: Path) -> None:
    glow = np.zeros((8, 8, 3), np.uint8)
    glow[:, :2] = (255, 0, 255)
    Image.fromarray(glow).save(tmp_path / "glow.png")
    library = "newmtl M\nKe 1 1 1\n" + "".join(f"{m} glow.png\n" for m in MAPS)
    (tmp_path / "lamp.mtl").write_text(library)
    text = f"mtllib lamp.mtl\n{VERTICES}usemtl M\nf 1 2 3\n"
    (tmp_path / "lamp.obj").write_text(text)
    lamp, _ = read_lamp(tmp_path / "lamp.obj", Options(units="m", up="z"))
    (part,) = lamp.parts
    assert isinstance(part.material, Material)
    np.testing.assert_allclose(part.radiance, [0.0625, 0, 0.0625])  # of a quarter of the surface
    np.testing.assert_allclose(part.material.base_color, [0.2, 0, 0.2])
    assert part.material.normal is None
    assert any("without a known place" in line for line in lamp.notes.lines())


def test_a_lamp_that_glows_by_such_a_picture_is_written(tmp_path: Path) -> None:
    """Its portrait needs Mitsuba to aim at it."""
    Image.fromarray(np.full((8, 8, 3), 255, np.uint8)).save(tmp_path / "glow.png")
    (tmp_path / "lamp.mtl").write_text("newmtl M\nKe 1 1 1\nmap_Ke glow.png\n")
    text = f"mtllib lamp.mtl\n{VERTICES}usemtl M\nf 1 2 3\n"
    (tmp_path / "lamp.obj").write_text(text)
    made = import_lamp(tmp_path / "lamp.obj", tmp_path / "out", Options(units="m", up="z"))
    assert made.scene.with_suffix(".png").is_file()
