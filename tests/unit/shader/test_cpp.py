"""The C++ runtime: the program that tests a lamp, rows at a time, and points of the surface."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest

from purelight_format import measures
from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_onnx.luminaire import Luminaire
from purelight_shader import library, write
from purelight_shader.library import Library, build, pointer
from tests.support.compiled import require_compilers

BY_AREA = 0.2
DIMMER = ctypes.c_double(1)


@pytest.fixture(scope="module")
def compiled(octahedron: Bundle, tmp_path_factory: pytest.TempPathFactory) -> Library:
    require_compilers()
    return build(octahedron, tmp_path_factory.mktemp("cpp"), ("-O1",))


def outcome(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["./selftest", "."], cwd=folder, capture_output=True, text=True, check=False
    )


def test_the_program_finds_what_is_right_and_what_is_not(
    octahedron: Bundle, tmp_path: Path
) -> None:
    require_compilers()
    write(octahedron, "cpp", tmp_path)
    strict = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(
        [*library.compiler(), *strict, "selftest.cpp", "-o", "selftest"], cwd=tmp_path, check=True
    )
    good = outcome(tmp_path)
    assert good.returncode == 0
    assert [line.split()[0] for line in good.stdout.splitlines()] == list(
        octahedron.manifest.networks
    )
    assert good.stdout.count("passed") == 5
    path = tmp_path / "floats.bin"
    data = path.read_bytes()
    path.write_bytes((np.frombuffer(data, "<f4") * np.float32(1.01)).astype("<f4").tobytes())
    bad = outcome(tmp_path)
    assert bad.returncode == 1
    assert "appearance" in bad.stdout
    assert "failed" in bad.stdout
    path.write_bytes(data[:-4])
    other = outcome(tmp_path)
    assert (other.returncode, other.stdout) == (2, "")
    assert other.stderr == "./floats.bin: does not belong to this code; write both anew\n"


def test_no_number_is_no_answer_however_it_is_compiled(octahedron: Bundle, tmp_path: Path) -> None:
    """With -ffast-math a compiler takes every number for a finite one."""
    require_compilers()
    write(octahedron, "cpp", tmp_path)
    program = tmp_path / "selftest.cpp"
    broken = "v.x * std::sqrt(-1.0f - std::fabs(v.x))"
    text = program.read_text().replace("{v.x, v.y, v.z}", f"{{{broken}, v.y, v.z}}")
    assert broken in text
    program.write_text(text)
    for mode in ("-O2", "-ffast-math"):
        build = [*library.compiler(), "-std=c++17", "-O2", mode, "selftest.cpp", "-o", "selftest"]
        subprocess.run(build, cwd=tmp_path, check=True)
        found = outcome(tmp_path)
        assert found.returncode == 1, mode
        assert "appearance inf failed" in found.stdout


def test_rows_are_those_of_the_onnx_runtime(octahedron: Bundle, compiled: Library) -> None:
    reference, rng = Luminaire(octahedron), np.random.default_rng(3)
    rows = rng.standard_normal((3, 1000, 3)).astype(np.float32)
    rows /= np.linalg.norm(rows, axis=2, keepdims=True)
    (light,) = compiled.ask("radiance", list(rows), [3])
    np.testing.assert_allclose(light, reference.radiance(*rows), rtol=1e-5)
    (through,) = compiled.ask("transmittance", list(rows), [3])
    np.testing.assert_allclose(through, reference.transmittance(*rows), rtol=1e-5)
    (cells,) = compiled.ask("radiance_map", [rows[0]], [768])
    expected = reference.radiance_map(rows[0]).reshape(-1, 768)
    np.testing.assert_allclose(cells, expected, rtol=1e-5)


def test_no_rows_are_no_rows(compiled: Library) -> None:
    (light,) = compiled.ask("radiance", [np.empty((0, 3))] * 3, [3])
    assert light.shape == (0, 3)


def test_extreme_inputs_end_nothing(compiled: Library) -> None:
    extremes = np.array([0, -1, 1e30, -3e38, np.inf, np.nan], np.float32)
    rows = np.repeat(extremes[:, None], 3, 1)
    for name, size in (("radiance", 3), ("transmittance", 3)):
        assert compiled.ask(name, [rows] * 3, [size])[0].shape == (6, size)
    assert compiled.ask("sample", [rows, rows[:, :2]], [3, 1])[0].shape == (6, 3)


def test_points_of_the_surface_have_their_density(octahedron: Bundle, compiled: Library) -> None:
    """Triangles are drawn by flux and area, points evenly on them, whatever their order."""
    count, surface = 80_000, octahedron.surface()
    u = np.random.default_rng(1).random((count, 3)).astype(np.float32)
    position, normal, pdf = compiled.ask("sample_surface", [u], [3, 3, 1])
    corners = surface.positions[surface.triangles].astype(np.float64)
    area = surface.area()
    own = np.argmin(
        [np.abs(((position - c[0]) * n).sum(1)) + 1e3 * outside(position, c, n)
         for c, n in zip(corners, normals(corners), strict=True)], 0)  # fmt: skip
    light = surface.triangle_flux.astype(np.float64) @ LUMINANCE
    chance = (1 - BY_AREA) * light / light.sum() + BY_AREA * area / area.sum()
    np.testing.assert_allclose(pdf[:, 0], (chance / area)[own], rtol=1e-5)
    drawn = np.bincount(own, minlength=len(area)) / count
    np.testing.assert_allclose(drawn, chance, atol=5 * np.sqrt(0.25 / count))
    np.testing.assert_allclose(np.abs((normal * normals(corners)[own]).sum(1)), 1, rtol=1e-5)
    middle = np.array([position[own == k].mean(0) for k in range(len(area))])
    spread = np.linalg.norm(corners.max(1) - corners.min(1), axis=1).max()
    np.testing.assert_allclose(middle, corners.mean(1), atol=5 * spread / np.sqrt(count / 8))


def normals(corners: np.ndarray) -> np.ndarray:
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit: np.ndarray = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    return unit


def outside(position: np.ndarray, corner: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Whether points lie beyond an edge of a triangle."""
    edges = np.roll(corner, -1, 0) - corner
    sides = [
        (np.cross(edge, position - at) * normal).sum(1)
        for edge, at in zip(edges, corner, strict=True)
    ]
    return np.min(sides, 0) < -1e-6


def test_directions_from_the_map_follow_it(octahedron: Bundle, compiled: Library) -> None:
    rng, count = np.random.default_rng(2), 200
    point = np.tile(np.array([[0.4, 0.3, 1.1]], np.float32), (count, 1))
    u = rng.random((count, 2)).astype(np.float32)
    place = np.eye(4).reshape(16)
    found = compiled.ask("instance_sample_map", [point, u], [3, 3, 1], pointer(place), DIMMER)
    cells = Luminaire(octahedron).radiance_map(point).astype(np.float64)
    cap = measures.cap(point.astype(np.float64), octahedron.manifest.bounding_sphere)
    radiance, toward, pdf = measures.draw_from_map(cells, u, cap)
    same = np.abs(u[:, 0] * 256 % 1 - 0.5) < 0.49  # Not on the border between two cells.
    assert same.mean() > 0.9
    np.testing.assert_allclose(found[0][same], radiance[same], rtol=1e-4)
    np.testing.assert_allclose(found[1][same], toward[same], atol=1e-4)
    np.testing.assert_allclose(found[2][same, 0], pdf[same], rtol=1e-4)


def test_a_transform_that_no_lamp_can_have_is_refused(compiled: Library) -> None:
    row = [np.zeros((1, 3), np.float32)] * 3
    for matrix, fault in (
        (np.diag([1.0, 2, 1, 1]), "differently"), (np.diag([-1.0, 1, 1, 1]), "mirrors"),
        (np.full((4, 4), np.nan), "finite"), (np.ones((4, 4)), "affine"),
    ):  # fmt: skip
        place = matrix.reshape(16)
        with pytest.raises(PureLightError, match=fault):
            compiled.ask("instance_radiance", row, [3], pointer(place), DIMMER)


def test_a_lamp_of_one_network_says_what_it_lacks(alone: Bundle, tmp_path: Path) -> None:
    require_compilers()
    lamp = build(alone, tmp_path, ("-O0",))
    up = [np.array([[0, 0, z]], np.float32) for z in (0, 1, 1)]
    (light,) = lamp.ask("radiance", up, [3])
    np.testing.assert_array_equal(light, [[2, 1, 0.5]])
    assert lamp.ask("transmittance", up, [3])[0].tolist() == [[0, 0, 0]]
    with pytest.raises(PureLightError, match="no sampler"):
        lamp.ask("sample", [up[0], up[0][:, :2]], [3, 1])
    with pytest.raises(PureLightError, match="no radiance map"):
        lamp.ask("radiance_map", [up[0]], [768])
    lamp.close()
    with pytest.raises(PureLightError, match="open a lamp"):
        lamp.ask("radiance", up, [3])


def test_without_a_compiler_nothing_is_written(
    alone: Bundle, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CXX", str(tmp_path / "none"))
    with pytest.raises(PureLightError, match=r"install g\+\+ or clang\+\+, or set CXX"):
        build(alone, tmp_path / "out")
    assert not (tmp_path / "out").exists()
