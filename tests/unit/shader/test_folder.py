"""The folder that is made of a bundle: complete, in words of ours, and refused where need be."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import helper

from purelight_format import bundle, members
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader import TARGETS, contents, write
from purelight_shader.output import targets
from tests.support import bundles, lamp
from tests.support.compiled import require_compilers

FUNCTIONS = ("radiance", "transmittance", "sample", "pdf_solid_angle", "radiance_map")
HOSTILE = '*/ }; #include "/etc/passwd" //'


def texts(files: dict[str, bytes]) -> str:
    return "\n".join(data.decode() for name, data in files.items() if not name.endswith(".bin"))


def spoilt(tmp_path: Path, change: Callable[[str, Any], None]) -> Bundle:
    """The lamp with its networks changed, which are still what their golden vectors say."""
    manifest, content = lamp.parts()
    golden = {}
    for name, make in lamp.NETWORKS.items():
        model = make()
        change(name, model.graph)
        data = model.SerializeToString()
        golden[name] = data, lamp.golden(name, data)
    return bundle.write(tmp_path / "lamp.plux", *bundles.with_networks((manifest, content), golden))


@pytest.mark.parametrize("language", TARGETS)
def test_every_language_has_all_functions(language: str, octahedron: Bundle) -> None:
    require_compilers()
    files = contents(octahedron, language, "bulb")
    code = next(data.decode() for name, data in files.items() if name.startswith("lamp."))
    for name in FUNCTIONS:
        assert f"bulb_{name}(" in code, name
    about, readme = json.loads(files["lamp.json"]), files["README.md"].decode()
    assert [made["name"] for made in about["functions"]] == [f"bulb_{name}" for name in FUNCTIONS]
    assert "$" not in readme
    assert all(f"`bulb_{name}`" in readme for name in FUNCTIONS)


def test_buffers_have_the_sizes_that_are_stated(octahedron: Bundle) -> None:
    files = contents(octahedron, "slang")
    about = json.loads(files["lamp.json"])
    test, surface = about["selftest"], about["surface"]
    assert len(files["floats.bin"]) == 16 * about["floats"]["fours"] > 0
    assert ("integers.bin" in files) == bool(about["integers"]["fours"])
    assert len(files["selftest_inputs.bin"]) == 4 * test["rows"] * test["inputs"]
    assert len(files["selftest_expected.bin"]) == 4 * test["rows"] * test["outputs"]
    assert len(files["surface_positions.bin"]) == 12 * surface["vertices"]
    assert len(files["surface_flux.bin"]) == 12 * surface["triangles"]


def test_textures_have_whole_rows(octahedron: Bundle) -> None:
    files = contents(octahedron, "webgl")
    about = json.loads(files["lamp.json"])
    texel_rows = about["floats"]["texture_rows"]
    assert len(files["floats.bin"]) == 16 * texel_rows * about["texture_width"]


def test_names_of_a_file_reach_no_text(tmp_path: Path) -> None:
    def rename(network: str, graph: Any) -> None:
        ports = {value.name for value in (*graph.input, *graph.output)}
        graph.name = HOSTILE
        for item in (*graph.node, *graph.initializer):
            item.name = item.name if item.name in ports else HOSTILE + (item.name or item.output[0])
        for node in graph.node:
            for names in (node.input, node.output):
                names[:] = [n if n in ports or not n else HOSTILE + n for n in names]

    hostile = spoilt(tmp_path, rename)
    named = bundles.with_networks(lamp.parts(), {})[0]
    assert HOSTILE.encode() in hostile.read("networks/appearance.onnx")
    for language in ("slang", "cpp"):
        said = texts(contents(hostile, language))
        assert "passwd" not in said
        assert named.name not in said


def test_the_same_bundle_gives_the_same_bytes(octahedron: Bundle) -> None:
    assert contents(octahedron, "slang") == contents(octahedron, "slang")


def with_integers(largest: int) -> Callable[[str, Any], None]:
    """Adds zero times a whole number that may be that large to the appearance."""

    def change(network: str, graph: Any) -> None:
        if network != "appearance":
            return
        (last,) = (node for node in graph.node if node.output[0] == "radiance")
        last.output[0] = "plain"
        node = helper.make_node
        graph.node.extend([
            node("Cast", ["position"], ["whole"], to=onnx.TensorProto.INT64),
            node("Mul", ["whole", "largest"], ["product"]),
            node("Mod", ["product", "seven"], ["rest"]),
            node("Cast", ["rest"], ["number"], to=onnx.TensorProto.FLOAT),
            node("Mul", ["number", "nothing"], ["none"]),
            node("Add", ["plain", "none"], ["radiance"]),
        ])  # fmt: skip
        for name, value in (("largest", np.array([largest])), ("seven", np.array([7])),
                            ("nothing", np.zeros(1, np.float32))):  # fmt: skip
            graph.initializer.append(onnx.numpy_helper.from_array(value, name))

    return change


@pytest.mark.parametrize("language", ["webgl", "wgsl"])
def test_integers_of_64_bits_are_refused_where_there_are_none(
    language: str, tmp_path: Path
) -> None:
    large = spoilt(tmp_path, with_integers(2**40))
    with pytest.raises(PureLightError, match=r"appearance: .* 64 bits.* choose cpp"):
        contents(large, language)
    assert "int64_t" in texts(contents(large, "slang"))


def test_integers_that_fit_into_32_bits_are_written_so(tmp_path: Path) -> None:
    small = spoilt(tmp_path, with_integers(2**20))
    assert "int64_t" not in texts(contents(small, "slang"))


def test_networks_that_no_gpu_has_room_for_are_refused(
    octahedron: Bundle, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(targets, "LONGEST", 1000)
    with pytest.raises(PureLightError, match="characters"):
        contents(octahedron, "slang")

    def wide(network: str, graph: Any) -> None:
        if network == "appearance":
            graph.node[1].output[0] = "narrow"
            shape = np.array([-1, 8, 1])
            graph.initializer.append(onnx.numpy_helper.from_array(shape, "column"))
            spread = np.ones((8, 4000), np.float32)
            spread[0, 0] = 2
            graph.initializer.append(onnx.numpy_helper.from_array(spread, "spread"))
            graph.initializer.append(onnx.numpy_helper.from_array(np.array([2]), "last"))
            node = helper.make_node
            added = [
                node("Reshape", ["narrow", "column"], ["tall"]),
                node("Mul", ["tall", "spread"], ["broad"]),
                node("Sin", ["broad"], ["bent"]),
                node("Softmax", ["bent"], ["shares"], axis=2),
                node("ReduceSum", ["shares", "last"], ["h0"], keepdims=0),
            ]
            rest = list(graph.node)
            del graph.node[:]
            graph.node.extend([*rest[:2], *added, *rest[2:]])

    monkeypatch.undo()
    large = spoilt(Path(octahedron.path).parent / "wide", wide)
    with pytest.raises(PureLightError, match=r"arrays of .* numbers, and HLSL can take"):
        contents(large, "hlsl")


def test_a_prefix_is_a_name(octahedron: Bundle) -> None:
    for prefix in ("", "a b", "1a", "a;b", "A", "x" * 40):
        with pytest.raises(PureLightError, match="prefix"):
            contents(octahedron, "slang", prefix)


def test_nothing_is_written_where_there_is_no_compiler(
    octahedron: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PURELIGHT_SLANGC", str(tmp_path / "nothing"))
    with pytest.raises(PureLightError, match="PURELIGHT_SLANGC"):
        write(octahedron, "glsl", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    monkeypatch.setenv("PURELIGHT_SLANGC", "/bin/false")
    with pytest.raises(PureLightError, match="slangc refused the lamp"):
        write(octahedron, "glsl", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_golden_vectors_are_all_there(octahedron: Bundle) -> None:
    files = contents(octahedron, "slang")
    about = json.loads(files["lamp.json"])["selftest"]
    rows = np.frombuffer(files["selftest_inputs.bin"], "<f4").reshape(-1, about["inputs"])
    for index, network in enumerate(about["networks"]):
        vectors = octahedron.vectors(network)
        own = rows[rows[:, 0] == index, 1:]
        given = np.concatenate([a.reshape(len(a), -1) for a in vectors.inputs.values()], 1)
        np.testing.assert_array_equal(own[:, : given.shape[1]], given)
    assert members.network("appearance") in octahedron.entries


def test_files_of_others_are_left_alone(octahedron: Bundle, tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("An engine\n")
    with pytest.raises(PureLightError, match=r"README.md: is there and not of a lamp in slang"):
        write(octahedron, "slang", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]
    for spoilt_json in ("[", "[" * 100_000, "{}", '{"language": "slang"}', '"language"'):
        (tmp_path / "lamp.json").write_text(spoilt_json)
        with pytest.raises(PureLightError, match="is there and not of a lamp"):
            write(octahedron, "slang", tmp_path)
    assert readme.read_text() == "An engine\n"


def test_a_folder_holds_one_language(octahedron: Bundle, alone: Bundle, tmp_path: Path) -> None:
    """Buffers of the same name are laid out otherwise for other languages."""
    write(octahedron, "slang", tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(PureLightError, match=r"holds a lamp in slang, .*choose another folder"):
        write(octahedron, "osl", tmp_path)
    assert before == {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    (tmp_path / "integers.bin").write_bytes(b"of the lamp before")
    write(alone, "slang", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(before)
    assert alone.digest in (tmp_path / "README.md").read_text()


def test_what_was_cut_off_is_finished(octahedron: Bundle, tmp_path: Path) -> None:
    write(octahedron, "slang", tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for name in ("README.md", "lamp.json", "selftest_expected.bin"):
        (tmp_path / name).unlink()
    write(octahedron, "slang", tmp_path)
    assert before == {path.name: path.read_bytes() for path in tmp_path.iterdir()}


def test_the_page_speaks_of_buffers_that_there_are(tmp_path: Path, octahedron: Bundle) -> None:
    """A lamp whose radiance is max(0, outgoing) has no constant."""
    data = lamp.model(
        "appearance", [helper.make_node("Relu", ["outgoing"], ["radiance"])], {}
    ).SerializeToString()
    given = bundles.parts(
        lamp.surface(), {"appearance": (data, lamp.golden("appearance", data))}, name="bare",
        bounding_sphere=lamp.SPHERE, flux=lamp.FLUX, radiance_scale=lamp.SCALE, r_max=15.0,
        channels=(True, True, True),
    )  # fmt: skip
    smallest = bundle.write(tmp_path / "bare.plux", *given)
    files = contents(smallest, "slang")
    assert "floats.bin" not in files
    assert "This lamp has none" in files["README.md"].decode()
    assert "(0 of them)" not in files["README.md"].decode()
    assert "`floats.bin` holds weights" in contents(octahedron, "slang")["README.md"].decode()
