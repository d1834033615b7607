"""Truncated and mutated files of every format: read, or refused in one line; never a crash."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_import import formats
from purelight_import.importing import read_lamp
from purelight_import.options import Options
from tests.support.lamp_files import draco, glb, mitsuba, model, obj, usd
from tests.support.lamp_files.model import Piece

SMALL = [
    Piece("Bulb", model.ball(0.02, 1), "Glow", {"base": (0.0, 0.0, 0.0)}, model.RADIANCE),
    model.base(),
]
QUICK, LONG = 150, 3000


def gltf(folder: Path) -> Path:
    made = glb.of([*SMALL, model.globe(model.ball(0.05, 1))])
    made.light("Spark", (0, 0, 0))
    return made.write(folder / "lamp.glb")


def compressed(folder: Path) -> Path:
    return draco.packed(glb.of(SMALL)).write(folder / "lamp.glb")


MAKERS: dict[str, Callable[[Path], list[Path]]] = {
    "glb": lambda folder: [gltf(folder)],
    "obj": lambda folder: [obj.write(folder, SMALL), folder / "shelf_light.mtl"],
}
ISOLATED: dict[str, Callable[[Path], list[Path]]] = {
    "draco": lambda folder: [compressed(folder)],
    "usda": lambda folder: [usd.write(folder, SMALL)],
    "mitsuba": lambda folder: [mitsuba.write(folder, SMALL, "0.6.0"), folder / "Bulb.ply"],
}


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A file cut short, with bytes changed, or with a piece of it moved."""
    kind, at = rng.integers(4), int(rng.integers(len(data)))
    if kind == 0:
        return data[:at]
    changed = bytearray(data)
    if kind == 1:
        for place in rng.integers(len(data), size=int(rng.integers(1, 8))):
            changed[place] = int(rng.integers(256))
    elif kind == 2:  # numbers and words are what readers act on
        word = [b"-1", b"99999999999", b"1e400", b"nan", b"null", b"[]", b"{}", b'"', b"0"]
        changed[at : at + int(rng.integers(1, 6))] = word[int(rng.integers(len(word)))]
    else:
        length = int(rng.integers(1, 64))
        target = int(rng.integers(len(data)))
        changed[target : target + length] = data[at : at + length]
    return bytes(changed)


def attack(make: Callable[[Path], list[Path]], folder: Path, count: int, seed: int) -> int:
    """Reads mutants; returns how many were taken all the same."""
    files = make(folder)
    whole = {file: file.read_bytes() for file in files}
    rng, taken = np.random.default_rng(seed), 0
    for k in range(count):
        file = files[k % len(files)]
        file.write_bytes(mutated(whole[file], rng))
        try:
            lamp, _ = read_lamp(files[0], Options(units="cm", pieces=("*",)))
        except PureLightError:
            continue
        finally:
            file.write_bytes(whole[file])
        taken += 1
        assert all(np.isfinite(p.mesh.positions).all() for p in lamp.parts)
    return taken


@pytest.mark.parametrize("kind", MAKERS)
def test_mutants(kind: str, tmp_path: Path) -> None:
    assert 0 < attack(MAKERS[kind], tmp_path, QUICK, 1) < QUICK


@pytest.mark.slow
@pytest.mark.parametrize("kind", MAKERS)
def test_many_mutants(kind: str, tmp_path: Path) -> None:
    assert 0 < attack(MAKERS[kind], tmp_path, LONG, 2) < LONG


@pytest.mark.slow
@pytest.mark.parametrize("kind", ISOLATED)
def test_mutants_read_by_libraries(kind: str, tmp_path: Path) -> None:
    assert 0 < attack(ISOLATED[kind], tmp_path, 60, 3) < 60


@pytest.mark.parametrize("name", ["lamp.glb", "lamp.gltf", "lamp.obj"])
@pytest.mark.parametrize("data", [b"", b"\0" * 64, b"glTF\2\0\0\0\xff\xff\xff\xff", b"[" * 100_000])
def test_what_is_no_lamp_at_all(name: str, data: bytes, tmp_path: Path, fault: Any) -> None:
    (tmp_path / name).write_bytes(data)
    assert str(tmp_path / name) in fault(tmp_path / name)


def test_counts_are_checked_before_room_is_made(tmp_path: Path, fault: Any) -> None:
    made = glb.of(SMALL)
    made.json["accessors"][0] |= {"count": 2**40}
    made.json["accessors"][0].pop("bufferView")
    assert "values" in fault(made.write(tmp_path / "lamp.glb"))


@pytest.mark.parametrize(
    ("count", "subdivisions", "what"), [(90_000, 1, "20,000 parts"), (1_000, 5, "10,000,000 tri")]
)
def test_instances_without_an_end(
    count: int, subdivisions: int, what: str, tmp_path: Path, fault: Any
) -> None:
    """They are counted before they are made."""
    made = glb.of([replace(SMALL[0], mesh=model.ball(0.02, subdivisions))])
    moves = made.accessor(np.zeros((count, 3)))
    extension = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": moves}}}
    made.node(mesh=0, extensions=extension)
    assert f"more than {what}" in fault(made.write(tmp_path / "lamp.glb"))


def test_nodes_in_circles(tmp_path: Path, fault: Any) -> None:
    made = glb.of(SMALL)
    made.json["nodes"][0]["children"] = [1]
    made.json["nodes"][1]["children"] = [0]
    made.json["scenes"][0]["nodes"] = [0]
    assert "no trees" in fault(made.write(tmp_path / "lamp.glb"))


def test_large_pictures_are_not_unpacked(tmp_path: Path) -> None:
    """A PNG of 100,000 x 100,000 pixels in a few bytes."""
    import struct
    import zlib

    def chunk(kind: bytes, body: bytes) -> bytes:
        crc = struct.pack(">I", zlib.crc32(kind + body))
        return struct.pack(">I", len(body)) + kind + body + crc

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0))
    png = b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
    made = glb.of(SMALL)
    texture = {"baseColorTexture": {"index": made.image(png)}}
    made.json["materials"][1]["pbrMetallicRoughness"] |= texture
    lamp = formats.read(made.write(tmp_path / "lamp.glb"))
    assert any("texture is left out" in line for line in lamp.notes.lines())
