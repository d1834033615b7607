"""Source files of Zemax, binary and text."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from purelight_format.cli import inspect_main
from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import file_of, rays_of
from purelight_format.ray_file.files import read_ray_file, write_ray_file
from tests.support.rays import ball, geometry, zemax

RAYS = ball(300)
PLACES = geometry(RAYS)
FLUX = np.full((300, 1), 0.5, np.float32)
LUMENS = np.concatenate([PLACES, FLUX], 1)


def put(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    ("unit", "metres"), [(0, 1.0), (1, 0.0254), (2, 0.01), (3, 0.3048), (4, 1e-3)]
)
def test_units_of_length(unit: int, metres: float, tmp_path: Path) -> None:
    path = put(tmp_path / "led.dat", zemax(LUMENS, unit=unit, flux_kind=1, flux=150))
    rays = rays_of(read_ray_file(path))
    np.testing.assert_allclose(rays.position, PLACES[:, :3] * metres, rtol=1e-6)
    assert rays.lumens == pytest.approx(150)
    assert rays.notes == ()


def test_wavelengths_are_in_micrometres(tmp_path: Path) -> None:
    wave = np.full((300, 1), 0.52, np.float32)
    path = put(tmp_path / "led.sdf", zemax(np.concatenate([LUMENS, wave], 1), kind=2, flux=150))
    assert rays_of(read_ray_file(path)).lumens == pytest.approx(150 * 683 * 0.71, rel=1e-3)
    path = put(tmp_path / "led.sdf", zemax(LUMENS, wavelength=0.52, flux=150))
    assert rays_of(read_ray_file(path)).lumens == pytest.approx(150 * 683 * 0.71, rel=1e-3)


@pytest.mark.parametrize("columns", [7, 8])
def test_text(columns: int, tmp_path: Path) -> None:
    rows = np.concatenate([LUMENS, np.full((300, 1), 0.55)], 1)[:, :columns]
    lines = ["300 4", *(" ".join(f"{x:.7g}" for x in row) for row in rows)]
    for end, glue in (("\n", " "), ("\r\n", "\t"), ("\n", ", ")):
        text = end.join(line.replace(" ", glue) for line in lines) + end
        rays = rays_of(read_ray_file(put(tmp_path / "led.dat", text.encode())))
        np.testing.assert_allclose(rays.position, RAYS.position, rtol=1e-5)
        assert "taken as watts" in rays.notes[0]
    short = "\n".join(["500 4", *lines[1:]]).encode()
    assert "announces 500" in rays_of(read_ray_file(put(tmp_path / "led.dat", short))).notes[1]


def test_the_round_trip_is_identical(tmp_path: Path) -> None:
    path = put(tmp_path / "led.dat", zemax(LUMENS, flux_kind=1, flux=150))
    write_ray_file(tmp_path / "again.sdf", read_ray_file(path))
    again = read_ray_file(tmp_path / "again.sdf")
    np.testing.assert_array_equal(again.rows, LUMENS)
    write_ray_file(tmp_path / "other.tm25ray", again)
    np.testing.assert_array_equal(read_ray_file(tmp_path / "other.tm25ray").rows, LUMENS)


def test_units_are_brought_to_those_of_tm25(tmp_path: Path) -> None:
    wave = np.full((300, 1), 0.5, np.float32)
    path = put(tmp_path / "led.dat", zemax(np.concatenate([LUMENS, wave], 1), unit=2, kind=2))
    write_ray_file(tmp_path / "led.tm25ray", read_ray_file(path))
    found = read_ray_file(tmp_path / "led.tm25ray")
    np.testing.assert_allclose(found.column("wavelength"), 500)
    np.testing.assert_allclose(found.rows[:, :3], PLACES[:, :3] * 10, rtol=1e-6)


def test_rays_without_their_colour(tmp_path: Path) -> None:
    write_ray_file(tmp_path / "ball.sdf", file_of(RAYS, "ball"))
    found = rays_of(read_ray_file(tmp_path / "ball.sdf"))
    assert found.lumens == pytest.approx(RAYS.lumens, rel=1e-5)
    assert "white" in found.colors


@pytest.mark.parametrize(
    ("data", "message"),
    [(b"", "not a ray file"), (b"hello", "not a ray file"), (b"<?xml?>\n<scene/>", "not a ray"),
     (b"1 9\n1 2 3 4 5 6 7\n", "not a ray"), (b"1 4\n1 2 3\n", "not a ray"),
     (b"1 4\n1 2 3 4 5 6 x\n", "not a ray"), (zemax(LUMENS)[:-3], "cut off"),
     (zemax(LUMENS, count=4_000_000_000), "cut off"), (zemax(LUMENS, count=0), "0 rays"),
     (zemax(LUMENS, kind=7), "unknown kind"), (zemax(LUMENS, unit=9), "unknown kind"),
     (b"\0" * 5000, "not a ray file")],
)  # fmt: skip
def test_what_is_wrong_is_said_in_a_line(data: bytes, message: str, tmp_path: Path) -> None:
    path = put(tmp_path / "led.dat", data)
    with pytest.raises(PureLightError, match=f"led.dat: .*{message}"):
        read_ray_file(path)


def test_names_and_places(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="must end in"):
        write_ray_file(tmp_path / "led.txt", file_of(RAYS, "x"))
    with pytest.raises(PureLightError, match="cannot read"):
        read_ray_file(tmp_path / "nowhere.dat")
    with pytest.raises(PureLightError, match="cannot read"):
        read_ray_file(tmp_path)


def test_inspect_says_what_a_file_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = put(tmp_path / "led.dat", zemax(LUMENS, flux_kind=1, flux=100))
    assert inspect_main([str(path)]) == 0
    text = capsys.readouterr().out
    assert "LED: 300 rays" in text
    assert "its header says 100 lumens" in text
    assert "the rays count" in text
    assert inspect_main([str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lumens"] == pytest.approx(150)
