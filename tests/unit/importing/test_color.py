"""Colour temperatures against published values."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_format.color import LUMINANCE, lumens
from purelight_import.model.color import TO_RGB, black_body, matching, watts


def chromaticity(rgb: tuple[float, float, float]) -> tuple[float, float]:
    xyz = np.linalg.inv(TO_RGB) @ np.array(rgb)
    x, y = (xyz / xyz.sum())[:2].tolist()
    return x, y


@pytest.mark.parametrize(
    ("kelvin", "x", "y"),
    [
        (2856, 0.4476, 0.4075),  # CIE standard illuminant A
        (4000, 0.3805, 0.3768), (6500, 0.3135, 0.3237), (10000, 0.2807, 0.2884),
    ],
)  # fmt: skip
def test_the_planckian_locus(kelvin: float, x: float, y: float) -> None:
    assert chromaticity(black_body(kelvin)) == pytest.approx((x, y), abs=2e-3)


@pytest.mark.parametrize("kelvin", [500, 1000, 2700, 6500, 25000])
def test_every_temperature_has_luminance_one_and_no_negative_light(kelvin: float) -> None:
    color = np.array(black_body(kelvin))
    assert (color >= 0).all()
    assert pytest.approx(1) == LUMINANCE @ color


def test_matching_functions_peak_where_the_tables_do() -> None:
    wavelength = np.arange(380.0, 781.0)
    x, y, z = matching(wavelength)
    assert wavelength[y.argmax()] == pytest.approx(555, abs=3)
    assert wavelength[x.argmax()] == pytest.approx(599, abs=3)
    assert wavelength[z.argmax()] == pytest.approx(446, abs=3)
    assert np.trapezoid(y, wavelength) == pytest.approx(106.857, rel=0.005)


def test_lumens_are_lumens_in_any_colour() -> None:
    for color in ((1.0, 1.0, 1.0), (3.0, 0.5, 0.0)):
        assert lumens(watts(806, color)) == pytest.approx(806)
