"""Intensity tables and IES text, read back by an independent reader."""

from __future__ import annotations

import numpy as np
import pytest
from photompy import IESFile

from purelight_export.photometry import Intensity, ies_file, intensity, unit_ies_file
from purelight_format.color import LUMENS_PER_WATT, lumens
from purelight_format.photometry.reader import read_ies
from purelight_format.photometry.table import node_solid_angle

FLUX = (3.0, 2.0, 0.5)


def directions(count: int, power: float = 0.0, seed: int = 1) -> np.ndarray:
    """Directions [count, 3] with density proportional to cos(angle to nadir)^power."""
    rng = np.random.default_rng(seed)
    v = 1 - rng.random(count)
    z = -(v ** (1 / (power + 1))) if power else 2 * v - 1
    phi, r = 2 * np.pi * rng.random(count), np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)


def table(power: float = 0.0, count: int = 200_000) -> Intensity:
    d = directions(count, power)
    return intensity(d, np.ones_like(d), FLUX)


def read(data: bytes) -> IESFile:
    return IESFile.read(data)


def test_the_hats_cover_the_sphere() -> None:
    assert node_solid_angle(np.linspace(0, 180, 37)).sum() == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("power", [0.0, 1.0, 20.0])
def test_the_table_integrates_to_the_flux(power: float) -> None:
    np.testing.assert_allclose(table(power).flux, FLUX, rtol=1e-9)


@pytest.mark.parametrize("power", [0.0, 1.0, 20.0])
def test_a_reader_gets_the_flux_back(power: float) -> None:
    file = read(ies_file(table(power), name="lamp", issued="2026-01-01", radius=0.25))
    assert file.photometry.total_optical_power() == pytest.approx(lumens(np.array(FLUX)), rel=0.01)


def test_our_own_reader_gets_the_table_back() -> None:
    written = table(1.0).luminous
    found = read_ies(ies_file(table(1.0), name="lamp", issued="2026-01-01", radius=0.25), "lamp")
    np.testing.assert_allclose(found.vertical, written.vertical)
    np.testing.assert_allclose(found.horizontal, written.horizontal)
    np.testing.assert_allclose(found.candela, written.candela, rtol=1e-5)


def test_uniform_light_has_uniform_intensity() -> None:
    values = table().values
    expected = np.array(FLUX) / (4 * np.pi)
    inner = values[:, 8:-8] / expected
    assert np.abs(inner.mean((0, 1)) - 1).max() < 0.01
    assert np.abs(inner - 1).max() < 0.5


def test_a_lambertian_lamp_keeps_its_cosine() -> None:
    result = table(1.0)
    cosine = np.cos(np.radians(result.vertical)).clip(0)
    profile = result.values[:-1].mean(0)[:, 0] / (FLUX[0] / np.pi)
    assert np.abs(profile - cosine).max() < 0.03


@pytest.mark.parametrize(
    ("direction", "plane", "row"),
    [((0, 0, -1), 0, 0), ((0, 0, 1), 0, 72), ((1, 0, 0), 0, 36), ((0, 1, 0), 6, 36),
     ((-1, 0, 0), 12, 36), ((0, -1, 0), 18, 36)],
)  # fmt: skip
def test_axes_are_where_the_convention_says(
    direction: tuple[float, float, float], plane: int, row: int
) -> None:
    result = intensity(np.array([direction]), np.ones((1, 3)), FLUX)
    peak = np.unravel_index(result.values[:-1, :, 0].argmax(), result.values[:-1, :, 0].shape)
    assert peak == (plane, row)
    np.testing.assert_allclose(result.flux, FLUX)


def test_the_last_plane_repeats_the_first() -> None:
    values = table().values
    np.testing.assert_array_equal(values[0], values[-1])


def test_the_header_is_absolute_type_c_from_a_simulation() -> None:
    text = ies_file(table(), name="lamp", issued="2026-01-01", radius=0.25).decode("ascii")
    lines = text.split("\r\n")
    assert lines[0] == "IES:LM-63-2019"
    start = lines.index("TILT=NONE")
    assert lines[start + 1] == "1 -1 1 73 25 1 2 -0.5 -0.5 -0.5"
    assert lines[start + 2].split()[:2] == ["1", "1.00010"]
    assert f"{LUMENS_PER_WATT:g} lm/W" in text
    assert max(map(len, lines)) <= 200


def test_the_unit_shape_has_mean_one() -> None:
    file = read(unit_ies_file(table(20.0), name="lamp", issued="2026-01-01"))
    assert file.photometry.values.shape == (1, 73)
    assert file.photometry.total_optical_power() == pytest.approx(4 * np.pi, rel=0.01)


def test_a_black_lamp_has_an_empty_table_and_a_uniform_shape() -> None:
    d = directions(10)
    black = intensity(d, np.zeros_like(d), (0.0, 0.0, 0.0))
    assert not black.values.any()
    shape = read(unit_ies_file(black, name="lamp", issued="2026-01-01"))
    assert (shape.photometry.values == 1).all()


def test_no_escaped_light_at_all_is_a_black_lamp() -> None:
    empty = intensity(np.zeros((0, 3)), np.zeros((0, 3)), (0.0, 0.0, 0.0))
    assert not empty.flux.any()


def test_a_red_only_lamp_stays_red() -> None:
    d = directions(1000)
    red = intensity(d, np.array([[1.0, 0.0, 0.0]]).repeat(1000, 0), (2.0, 0.0, 0.0))
    np.testing.assert_allclose(red.flux, [2.0, 0.0, 0.0])


def test_a_name_in_any_script_gives_plain_ascii() -> None:
    ies_file(table(), name="Lämp\n[TEST] x", issued="2026-01-01", radius=1).decode("ascii")
