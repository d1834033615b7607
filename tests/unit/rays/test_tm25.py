"""TM-25 files: written and read, and packed byte by byte."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import file_of, rays_of
from purelight_format.ray_file.files import read_ray_file, write_ray_file
from purelight_format.ray_file.ray_file import RayFile
from tests.support.rays import ball, disc, geometry, tm25

RAYS = ball(500)
PLACES = geometry(RAYS)
WATT, WAVE, LUMEN = (
    np.full((500, 1), 2e-3),
    np.linspace(450, 650, 500)[:, None],
    np.full((500, 1), 0.4),
)
FLAT = [(400.0, 1.0), (500.0, 1.0), (600.0, 1.0)]
BLUE = [(440.0, 0.5), (460.0, 1.0)]
Write = Callable[[bytes], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def put(data: bytes) -> Path:
        path = tmp_path / "led.tm25ray"
        path.write_bytes(data)
        return path

    return put


def rows(*columns: np.ndarray) -> np.ndarray:
    return np.concatenate([PLACES, *columns], 1).astype(np.float32)


def layouts() -> dict[str, bytes]:
    """Files of every kind that the flags allow."""
    index = np.tile([[1.0], [2.0]], (250, 1))
    stokes = np.zeros((500, 3))
    return {
        "watts": tm25(rows(WATT), (1, 1, 1, 0, 0, 0, 0, 0), watts=1, lumens=300),
        "lumens": tm25(rows(LUMEN), (1, 1, 0, 0, 1, 0, 0, 0), lumens=200),
        "one wavelength": tm25(rows(WATT), (1, 1, 1, 0, 0, 0, 0, 0), spectral=1, wavelength=520),
        "wavelengths": tm25(rows(WATT, WAVE), (1, 1, 1, 1, 0, 0, 0, 0), spectral=2),
        "one spectrum": tm25(rows(WATT), (1, 1, 1, 0, 0, 0, 0, 0), spectral=3, spectra=[FLAT]),
        "spectra": tm25(
            rows(WATT, index), (1, 1, 1, 0, 0, 0, 0, 1), spectral=4, spectra=[FLAT, BLUE]
        ),
        "tristimulus": tm25(rows(LUMEN, LUMEN, LUMEN / 2), (1, 1, 0, 0, 1, 0, 1, 0)),
        "both fluxes": tm25(
            rows(WATT, LUMEN), (1, 1, 1, 0, 1, 0, 0, 0), spectral=3, spectra=[BLUE]
        ),
        "stokes": tm25(rows(WATT, stokes), (1, 1, 1, 0, 0, 1, 0, 0), watts=1, lumens=300),
        "stokes and ellipse": tm25(
            rows(WATT, stokes, stokes), (1, 1, 1, 0, 0, 1, 0, 0), watts=1, lumens=300
        ),
        "labels and text": tm25(
            rows(LUMEN, WATT), (1, 1, 0, 0, 1, 0, 0, 0), labels=["dice"], text="hello"
        ),
        "2020": tm25(rows(LUMEN), (1, 1, 0, 0, 1, 0, 0, 0), version=2020),
    }


@pytest.mark.parametrize("data", layouts().values(), ids=layouts())
def test_every_layout_is_read(data: bytes, write: Write) -> None:
    file = read_ray_file(write(data))
    np.testing.assert_array_equal(file.rows[:, :6], PLACES)
    assert file.name == "LED"
    rays = rays_of(file)
    np.testing.assert_allclose(rays.position, RAYS.position, rtol=1e-6)
    np.testing.assert_allclose(rays.direction, RAYS.direction, atol=1e-6)
    assert (rays.power >= 0).all()
    assert rays.lumens > 0


@pytest.mark.parametrize("name", [n for n in layouts() if "stokes" not in n and "label" not in n])
def test_the_round_trip_is_identical(name: str, write: Write, tmp_path: Path) -> None:
    file = read_ray_file(write(layouts()[name]))
    write_ray_file(tmp_path / "again.tm25ray", file)
    again = read_ray_file(tmp_path / "again.tm25ray")
    np.testing.assert_array_equal(again.rows, file.rows)
    assert (again.columns, again.wavelength, again.texts) == (
        file.columns, file.wavelength, {**file.texts, "additional": ""}
    )  # fmt: skip
    for one, other in zip(again.spectra, file.spectra, strict=True):
        np.testing.assert_array_equal(one, other)
    write_ray_file(tmp_path / "third.tm25ray", again)
    assert (tmp_path / "third.tm25ray").read_bytes() == (tmp_path / "again.tm25ray").read_bytes()


def test_rays_come_back(tmp_path: Path) -> None:
    for rays in (ball(1000), disc(1000)):
        write_ray_file(tmp_path / "a.tm25ray", file_of(rays, "a"))
        found = rays_of(read_ray_file(tmp_path / "a.tm25ray"))
        np.testing.assert_allclose(found.position, rays.position, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found.direction, rays.direction, rtol=1e-6, atol=1e-7)
        np.testing.assert_allclose(found.power, rays.power, rtol=2e-5)
        assert (found.power[:, rays.power.max(0) == 0] == 0).all()  # Dark channels stay dark.
        assert found.notes == ()


def told(data: bytes, write: Write) -> tuple[RayFile, str]:
    file = read_ray_file(write(data))
    return file, " / ".join(rays_of(file).notes)


def test_the_header_is_compared_with_the_rays(write: Write) -> None:
    right = tm25(rows(LUMEN), (1, 1, 0, 0, 1, 0, 0, 0), lumens=200)
    assert told(right, write)[1] == ""
    wrong = tm25(rows(LUMEN), (1, 1, 0, 0, 1, 0, 0, 0), lumens=1)
    assert "header says 1 lumens, its rays sum up to 200" in told(wrong, write)[1]
    unknown = tm25(rows(LUMEN), (1, 1, 0, 0, 1, 0, 0, 0))
    assert told(unknown, write)[1] == ""


def test_flux_is_that_of_the_spectrum(write: Write) -> None:
    """Against the definition: lumens are 683 times the sum of watts and V(l)."""
    green = rays_of(read_ray_file(write(layouts()["one wavelength"])))
    assert green.lumens == pytest.approx(683 * 0.71, rel=1e-3)  # V(520 nm) = 0.710
    assert rays_of(read_ray_file(write(layouts()["lumens"]))).lumens == pytest.approx(200)
    assert rays_of(read_ray_file(write(layouts()["both fluxes"]))).lumens == pytest.approx(200)
    assert rays_of(read_ray_file(write(layouts()["watts"]))).lumens == pytest.approx(300)
    bare = tm25(rows(WATT), (1, 1, 1, 0, 0, 0, 0, 0))
    np.testing.assert_allclose(rays_of(read_ray_file(write(bare))).flux, [1, 1, 1], rtol=1e-5)


def test_blue_light_is_blue_and_white_light_is_white(write: Write) -> None:
    blue = rays_of(read_ray_file(write(layouts()["both fluxes"]))).flux
    assert blue[2] > 5 * blue[:2].max()
    assert np.ptp(rays_of(read_ray_file(write(layouts()["lumens"]))).flux) < 1e-4


def test_broken_rays_are_left_out(write: Write) -> None:
    spoilt = rows(LUMEN)
    spoilt[0, 0], spoilt[1, 4], spoilt[2, 6], spoilt[3, 6] = np.nan, np.inf, np.nan, -1
    spoilt[4, 3:6] = 0
    spoilt[5, 3:6] *= 7  # Only too long.
    file, notes = told(tm25(spoilt, (1, 1, 0, 0, 1, 0, 0, 0)), write)
    rays = rays_of(file)
    assert len(rays) == 495
    assert "5 rays without light" in notes
    np.testing.assert_allclose(np.linalg.norm(rays.direction, axis=1), 1, atol=1e-6)


def test_some_rays_stand_for_all(write: Write) -> None:
    rays = rays_of(read_ray_file(write(layouts()["lumens"])), most=100)
    assert len(rays) == 100
    assert rays.lumens == pytest.approx(200)
    assert rays.flux @ LUMINANCE == pytest.approx(200 / 683)


def test_what_follows_the_rays_is_said(write: Write) -> None:
    assert "3 bytes behind" in told(layouts()["lumens"] + b"xyz", write)[1]


GOOD = layouts()["one spectrum"]


def at(offset: int, data: bytes) -> bytes:
    return GOOD[:offset] + data + GOOD[offset + len(data) :]


@pytest.mark.parametrize(
    ("data", "message"),
    [(b"", "not a ray file"), (GOOD[:100], "cut off"), (GOOD[:36_300], "cut off"),
     (GOOD[:-4], "cut off"), (at(4, b"\x01\0\0\0"), "version 1"), (at(20, bytes(8)), "no rays"),
     (at(20, b"\xff" * 8), "cut off"), (at(76, b"\xff\xff\xff\x7f"), "spectra"),
     (at(76, b"\xff" * 4), "spectra"), (at(80, b"\xff\xff\0\0"), "columns"),
     (at(84, b"\x03\0\0\0"), "additional text"), (at(84, b"\0\0\0\x7f"), "cut off"),
     (at(256, b"\0"), "no position"), (at(264, b"\0"), "no flux"), (at(264, b"\7"), "neither"),
     (at(36_288, b"\xff\xff\xff\x7f"), "cut off"), (at(36_288, bytes(4)), "a spectrum of 0"),
     (at(36_292, b"\0\0\xc0\x7f"), "spectrum that is none")],
)  # fmt: skip
def test_what_is_wrong_is_said_in_a_line(data: bytes, message: str, write: Write) -> None:
    with pytest.raises(PureLightError, match=f"led.tm25ray: .*{message}"):
        read_ray_file(write(data))


def test_invisible_light_is_refused(write: Write) -> None:
    infrared = tm25(rows(WATT), (1, 1, 1, 0, 0, 0, 0, 0), spectral=1, wavelength=940)
    with pytest.raises(PureLightError, match="invisible"):
        rays_of(read_ray_file(write(infrared)))
    dark = tm25(rows(0 * LUMEN), (1, 1, 0, 0, 1, 0, 0, 0))
    with pytest.raises(PureLightError, match="no ray"):
        rays_of(read_ray_file(write(dark)))
