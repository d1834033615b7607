"""Colours of wavelengths and spectra, against Mitsuba's and against what is known."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.color import LUMINANCE
from purelight_format.ray_file.spectra import (
    RGB_TO_XYZ,
    displayable,
    displayable_power,
    observer,
    rgb,
    spectrum_xyz,
    wavelength_xyz,
)
from purelight_mitsuba.platform import use

use()


def test_the_observer_is_that_of_the_cie() -> None:
    nodes, values = observer()
    np.testing.assert_allclose(values, np.array(mi.cie1931_xyz(mi.Float(nodes))).T, rtol=1e-4)
    assert values[nodes == 555, 1] == pytest.approx(1, abs=2e-3)
    sums = values.sum(0)
    assert np.ptp(sums) / sums.mean() < 1e-3  # Light of equal energy is white.


def test_equal_energy_has_equal_tristimulus_values() -> None:
    xyz = spectrum_xyz(np.array([360.0, 830.0]), np.array([1.0, 1.0]))
    np.testing.assert_allclose(xyz / xyz[1], 1, atol=1e-3)


def test_a_narrow_spectrum_is_a_wavelength() -> None:
    line = spectrum_xyz(np.array([549.9, 550.0, 550.1]), np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(line, wavelength_xyz(np.array([550.0]))[0], rtol=1e-3)
    alone = spectrum_xyz(np.array([550.0]), np.array([3.0]))
    np.testing.assert_array_equal(alone, wavelength_xyz(np.array([550.0]))[0])


def test_disordered_spectra_are_put_in_order() -> None:
    up = spectrum_xyz(np.array([500.0, 550, 600]), np.array([1.0, 3, 2]))
    np.testing.assert_allclose(spectrum_xyz(np.array([600.0, 500, 550]), np.array([2.0, 1, 3])), up)


def test_white_of_the_screen_is_grey() -> None:
    np.testing.assert_allclose(rgb(RGB_TO_XYZ.sum(1)), 1, rtol=1e-9)


def test_saturated_colours_keep_their_luminance() -> None:
    color = rgb(wavelength_xyz(np.linspace(400, 700, 31)))
    assert color.min() < 0
    shown = displayable(color)
    assert shown.min() >= 0
    np.testing.assert_allclose(shown @ LUMINANCE, color @ LUMINANCE, rtol=1e-4, atol=1e-9)


def test_many_saturated_rays_make_white_together() -> None:
    """Each alone is out of gamut; their sum is not, and stays what it is."""
    color = rgb(wavelength_xyz(np.linspace(400, 700, 301)))
    power = displayable_power(color, np.ones(301))
    np.testing.assert_allclose(power.sum(0), color.sum(0), rtol=1e-9)
    assert power.min() >= 0
