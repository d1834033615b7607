"""glTF: odd accessors, hierarchies, materials and lights mean what the specification says."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.formats import read
from purelight_import.importing import read_lamp
from purelight_import.model.frame import Frame
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.picture import Picture
from purelight_import.options import Options
from tests.support.lamp_files import draco
from tests.support.lamp_files.glb import Glb

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def square(**material: Any) -> Glb:
    """A file with one square in the XY plane, facing +Z."""
    made = Glb()
    made.node(mesh=made.mesh("Square", SQUARE, FACES, made.material(**material)), name="Square")
    return made


def lamp_of(made: Glb, folder: Path) -> Lamp:
    return read(made.write(folder / "lamp.glb"))


def part_of(made: Glb, folder: Path) -> Part:
    (part,) = lamp_of(made, folder).parts
    return part


def material_of(folder: Path, **material: Any) -> Material:
    found = part_of(square(**material), folder).material
    assert isinstance(found, Material)
    return found


def extension(name: str, **values: Any) -> dict[str, Any]:
    return {"extensions": {f"KHR_materials_{name}": values}}


def png(pixels: Any) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()


def test_sparse_values_replace_some(tmp_path: Path) -> None:
    made = square()
    rows, values = made.view(struct.pack("<H", 2)), made.view(struct.pack("<3f", 5, 6, 7))
    made.json["accessors"][0]["sparse"] = {
        "count": 1, "indices": {"bufferView": rows, "componentType": 5123},
        "values": {"bufferView": values},
    }  # fmt: skip
    expected = SQUARE.copy()
    expected[2] = 5, 6, 7
    np.testing.assert_allclose(part_of(made, tmp_path).mesh.positions, expected)


def test_strided_and_quantised_positions(tmp_path: Path) -> None:
    made = square()
    rows = np.zeros((4, 8), "<i2")  # 16 bytes apart, of which 6 count
    rows[:, :3] = 32767 * SQUARE
    view = made.view(rows.tobytes(), byteStride=16)
    made.json["accessors"][0] |= {"bufferView": view, "componentType": 5122, "normalized": True}
    np.testing.assert_allclose(part_of(made, tmp_path).mesh.positions, SQUARE)


@pytest.mark.parametrize(("mode", "order"), [(5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])])
def test_strips_and_fans_face_one_way(mode: int, order: list[int], tmp_path: Path) -> None:
    made = square()
    primitive = made.json["meshes"][0]["primitives"][0]
    primitive |= {"mode": mode, "indices": made.accessor(order, "u1")}
    mesh = part_of(made, tmp_path).mesh
    assert mesh.area == pytest.approx(1)
    assert (mesh.cross[:, 2] > 0).all()


def test_nodes_within_nodes_with_a_mirror(tmp_path: Path) -> None:
    made = square()
    made.json["nodes"] = [
        {"name": "Arm", "scale": [2, 1, -1], "children": [1]},
        {"name": "Square", "mesh": 0, "translation": [1, 0, 3],
         "rotation": [0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)]},
    ]  # fmt: skip
    part = part_of(made, tmp_path)
    turned = SQUARE @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [1, 0, 3]
    np.testing.assert_allclose(part.mesh.positions, turned * [2, 1, -1], atol=1e-6)
    assert (part.mesh.cross[:, 2] < 0).all()  # its front goes where the mirror puts it
    assert part.names == ("Square", "Arm", "Square", "material_0")


def test_instances_and_shared_meshes(tmp_path: Path) -> None:
    made = square()
    moves = made.accessor([[0, 0, 0], [5, 0, 0], [10, 0, 0]])
    attributes = {"TRANSLATION": moves}
    made.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    made.node(name="Again", mesh=0, translation=[0, 7, 0])
    lamp = lamp_of(made, tmp_path)
    assert [p.name for p in lamp.parts] == ["Square", "Square_2", "Square_3", "Again"]
    assert [p.mesh.bounds[0].tolist() for p in lamp.parts[1:]] == [[5, 0, 0], [10, 0, 0], [0, 7, 0]]


def test_a_skin_puts_vertices_where_its_joints_are(tmp_path: Path) -> None:
    made = square()
    attributes = made.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = made.accessor(np.zeros((4, 4)), "u1")
    attributes["WEIGHTS_0"] = made.accessor(np.tile([1.0, 0, 0, 0], (4, 1)))
    joint = made.node(name="Joint", translation=[0, 0, 9])
    made.json["skins"] = [{"joints": [joint]}]
    made.json["nodes"][0] |= {"skin": 0, "translation": [100, 0, 0]}  # which a skin ignores
    np.testing.assert_allclose(part_of(made, tmp_path).mesh.positions[:, 2], 9)


def test_glass_in_all_its_words(tmp_path: Path) -> None:
    extensions = {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_ior": {"ior": 1.7},
        "KHR_materials_volume": {
            "thicknessFactor": 0.1, "attenuationDistance": 0.5, "attenuationColor": [0.5, 1, 0.25],
        },
    }  # fmt: skip
    glass = material_of(tmp_path, extensions=extensions)
    assert (glass.ior, glass.transmission, glass.thin_walled) == (1.7, 1.0, False)
    np.testing.assert_allclose(glass.attenuation, -np.log([0.5, 1, 0.25]) / 0.5, atol=1e-12)
    in_metres = glass.moved(Frame(0.001))
    np.testing.assert_allclose(in_metres.attenuation, np.array(glass.attenuation) * 1000)
    del extensions["KHR_materials_volume"]
    assert material_of(tmp_path, extensions=extensions).thin_walled


@pytest.mark.parametrize(("metallic", "glass"), [(None, False), (1, False), (0.5, True), (0, True)])
def test_metal_lets_no_light_through(tmp_path: Path, metallic: float | None, glass: bool) -> None:
    """Whatever its transmission is; exporters that leave `metallicFactor` out say metal."""
    factor = {} if metallic is None else {"metallicFactor": metallic}
    transmission = {"KHR_materials_transmission": {"transmissionFactor": 0.8}}
    made = square(pbrMetallicRoughness=factor, extensions=transmission)
    lamp = lamp_of(made, tmp_path)
    assert lamp.parts[0].material.glass == glass
    assert any("metal lets no light" in line for line in lamp.notes.lines()) != glass


def test_emission_is_in_candela_per_square_metre(tmp_path: Path) -> None:
    made = square(
        emissiveFactor=[1, 0.5, 0], **extension("emissive_strength", emissiveStrength=683)
    )
    np.testing.assert_allclose(part_of(made, tmp_path).radiance, [1, 0.5, 0])


def test_textures_of_each_channel(tmp_path: Path) -> None:
    made = square()
    pixels = np.zeros((2, 2, 4))
    pixels[0, 1] = [255, 128, 64, 51]
    texture = {"index": made.image(png(pixels))}
    made.material(
        name="Painted", alphaMode="BLEND", emissiveTexture=texture, emissiveFactor=[683, 683, 683],
        pbrMetallicRoughness={"baseColorTexture": texture, "metallicRoughnessTexture": texture},
    )  # fmt: skip
    made.json["meshes"][0]["primitives"][0]["material"] = 1
    part = part_of(made, tmp_path)
    material = part.material
    assert isinstance(material, Material)
    found = (material.base_color, material.roughness, material.metalness, material.opacity)
    colors, rough, metal, cover = (p.linear[0, 1] for p in found if isinstance(p, Picture))
    np.testing.assert_allclose(colors, [1, 0.2158605, 0.0512695], rtol=1e-5)  # of sRGB
    np.testing.assert_allclose((rough[0], metal[0], cover[0]), np.array([128, 64, 51]) / 255)
    assert isinstance(part.radiance, Picture)
    np.testing.assert_allclose(part.radiance.linear[0, 1], colors, rtol=1e-5)


@pytest.mark.parametrize(("mode", "cover"), [("OPAQUE", 1.0), ("BLEND", 0.3), ("MASK", 0.0)])
def test_coverage_counts_by_its_mode(mode: str, cover: float, tmp_path: Path) -> None:
    factor = {"baseColorFactor": [1, 1, 1, 0.3]}
    made = square(name="Bulb", alphaMode=mode, pbrMetallicRoughness=factor)
    lamp = lamp_of(made, tmp_path)
    (part,) = lamp.parts
    assert isinstance(part.material, Material)
    assert part.material.opacity == cover
    said = any("makes glass of it" in line for line in lamp.notes.lines())
    assert said == (mode == "BLEND")


@pytest.mark.parametrize("name", ["dispersion", "iridescence"])
def test_what_is_not_taken_is_said_once(name: str, tmp_path: Path) -> None:
    made = square(name="First", **extension(name))
    again = made.material(name="Second", **extension(name))
    made.node(mesh=made.mesh("Other", SQUARE, FACES, again))
    (line,) = [text for text in lamp_of(made, tmp_path).notes.lines() if name in text]
    assert "First, Second" in line


def test_a_point_light_becomes_a_small_sphere_of_its_flux(tmp_path: Path) -> None:
    made = square()
    made.light("Lamp", (0.5, 0.5, 0.02), intensity=50, color=[1, 1, 1])
    lamp, _ = read_lamp(made.write(tmp_path / "lamp.glb"))
    (bulb,) = [p for p in lamp.parts if p.radiance is not None]
    watts = np.pi * bulb.mesh.area * np.array(bulb.radiance)
    np.testing.assert_allclose(683 * watts, 4 * np.pi * 50, rtol=1e-3)
    half = np.ptp(bulb.mesh.bounds, axis=0)[0] / 2
    assert half <= 0.5 * 0.02 * 1.01  # half of the way to the square at most


def test_a_spot_has_the_flux_of_its_cone(tmp_path: Path) -> None:
    made = square()
    made.light("Spot", (0.5, 0.5, 0.5), "spot", 100,
               spot={"innerConeAngle": 0.7, "outerConeAngle": 0.7 + 1e-4})  # fmt: skip
    lamp, _ = read_lamp(made.write(tmp_path / "lamp.glb"))
    (disk,) = [p for p in lamp.parts if p.radiance is not None]
    watts = np.pi * disk.mesh.area * np.array(disk.radiance)
    np.testing.assert_allclose(683 * watts, 100 * 2 * np.pi * (1 - np.cos(0.7)), rtol=0.01)
    assert (disk.mesh.cross[:, 1] > 0).all()  # -Z of the node, which is +Y of the luminaire


def test_directional_light_is_the_rooms(tmp_path: Path) -> None:
    made = square(emissiveFactor=[1, 1, 1])
    made.light("Sun", (0, 0, 0), "directional")
    lamp, _ = read_lamp(made.write(tmp_path / "lamp.glb"))
    assert len(lamp.parts) == 1
    assert any("infinity" in line and "Sun" in line for line in lamp.notes.lines())


def test_a_double_sided_sheet_shines_both_ways(tmp_path: Path) -> None:
    made = square(emissiveFactor=[1, 1, 1], doubleSided=True)
    lamp, _ = read_lamp(made.write(tmp_path / "a.glb"), Options(lumens=100))
    assert [p.name for p in lamp.parts] == ["Square", "Square_back"]
    assert lamp.parts[0].mesh.cross[0] @ lamp.parts[1].mesh.cross[0] < 0


def test_meshes_that_draco_compressed(tmp_path: Path) -> None:
    """Corners, normals and texture coordinates, and a morph target over them."""
    made = square()
    named = made.json["meshes"][0]["primitives"][0]["attributes"]
    named["NORMAL"] = made.accessor(np.tile([0.0, 0.6, 0.8], (4, 1)))
    named["TEXCOORD_0"] = made.accessor([[0.0, 0], [1, 0.25], [1, 1], [0.5, 1]])
    made.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": made.accessor(SQUARE)}]
    made.json["meshes"][0]["weights"] = [0.5]
    plain = part_of(made, tmp_path).mesh
    compressed = part_of(draco.packed(made), tmp_path).mesh
    assert plain.normals is not None
    assert compressed.normals is not None
    assert compressed.uv is not None
    np.testing.assert_allclose(compressed.positions, plain.positions, atol=1e-4)
    np.testing.assert_allclose(compressed.normals, plain.normals, atol=1e-4)
    np.testing.assert_allclose(compressed.uv, plain.uv, atol=1e-4)
    np.testing.assert_array_equal(compressed.triangles, plain.triangles)


def test_draco_that_holds_something_else(tmp_path: Path, fault: Any) -> None:
    made = draco.packed(square())
    made.json["accessors"][0]["count"] = 5
    assert "compressed data" in fault(made.write(tmp_path / "lamp.glb"))
    made = draco.packed(square())
    primitive = made.json["meshes"][0]["primitives"][0]
    primitive["extensions"][draco.DRACO]["bufferView"] = made.view(b"DRACO and no more")
    assert "broken" in fault(made.write(tmp_path / "lamp.glb"))


def test_a_decoder_that_is_not_there(
    tmp_path: Path, fault: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "hidden").mkdir()
    (tmp_path / "hidden" / "DracoPy.py").write_text("raise ImportError")
    monkeypatch.syspath_prepend(tmp_path / "hidden")
    assert "pip install DracoPy" in fault(draco.packed(square()).write(tmp_path / "lamp.glb"))


def test_meshes_that_meshopt_compressed_are_one_clear_line(tmp_path: Path, fault: Any) -> None:
    made = square()
    made.json["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {}}
    assert "compressed (meshopt)" in fault(made.write(tmp_path / "lamp.glb"))


def test_files_outside_the_folder_are_not_read(tmp_path: Path, fault: Any) -> None:
    secret, inner = tmp_path / "secret.bin", tmp_path / "lamp"
    secret.write_bytes(bytes(1000))
    inner.mkdir()
    (inner / "link.bin").symlink_to(secret)
    for uri in ("../secret.bin", str(secret), "link.bin", "..%2Fsecret.bin"):
        made = square()
        data = made.bytes()
        text = data[20 : 20 + struct.unpack_from("<I", data, 12)[0]].decode()
        path = inner / "lamp.gltf"
        path.write_text(text.replace('"buffers": [{', f'"buffers": [{{"uri": "{uri}", '))
        assert "outside" in fault(path)
    path.write_text(path.read_text().replace("..%2Fsecret.bin", "https://example.org/a.bin"))
    assert "network" in fault(path)
