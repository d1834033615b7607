"""Colour of light from wavelengths, spectra and tristimulus values: linear Rec.709.

A channel's watts are as everywhere in the format: lumens are 683 times their luminance. So a watt
of light of wavelength l has the tristimulus values x(l), y(l), z(l) of the CIE 1931 observer.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE

Float = NDArray[np.float64]
RGB_TO_XYZ = np.array([  # ITU-R BT.709, item 1, with white D65.
    [0.4124, 0.3576, 0.1805],
    LUMINANCE,
    [0.0193, 0.1192, 0.9505],
])  # fmt: skip
ROUNDING = 1e-5  # Of the largest channel: what float32 leaves of a channel without light.


@cache
def observer() -> tuple[Float, Float]:
    """Wavelengths [W] in nm and the CIE 1931 2 degree colour matching functions [W, 3]."""
    text = files(__package__).joinpath("cie1931.csv").read_text()
    table = np.array([line.split(",") for line in text.split()[1:]], np.float64)
    return table[:, 0], table[:, 1:]


def wavelength_xyz(wavelength: Float) -> Float:
    """Tristimulus values of a watt of light of each wavelength: [N] in nm -> [N, 3]."""
    nodes, values = observer()
    columns = [np.interp(wavelength, nodes, column, left=0, right=0) for column in values.T]
    return np.stack(columns, -1)


def spectrum_xyz(wavelength: Float, weight: Float) -> Float:
    """Tristimulus values of a watt of light of a spectrum: [W] nm and [W] per nm -> [3].

    The spectrum is linear between its wavelengths; one wavelength alone is a line.
    """
    order = np.argsort(wavelength, kind="stable")
    wavelength, weight = wavelength[order], weight[order]
    if len(wavelength) == 1:
        return wavelength_xyz(wavelength)[0]
    fine = np.union1d(wavelength, observer()[0])
    fine = fine[(fine >= wavelength[0]) & (fine <= wavelength[-1])]
    density = np.interp(fine, wavelength, weight)
    step = np.diff(fine)
    share = np.zeros(len(fine))
    share[:-1] += step / 2
    share[1:] += step / 2
    total = float(share @ density)
    result: Float = (share * density) @ wavelength_xyz(fine) / total if total > 0 else np.zeros(3)
    return result


def rgb(xyz: Float) -> Float:
    """Linear Rec.709 of tristimulus values [..., 3], negative where a colour is too saturated."""
    result: Float = xyz @ np.linalg.inv(RGB_TO_XYZ).T
    return result


def displayable(color: Float) -> Float:
    """The nearest colours [N, 3] without negative channels, towards white at equal luminance.

    Channels that are nothing but rounding become zero.
    """
    luminance = (color @ LUMINANCE).clip(min=0)[:, None]
    lowest = color.min(1, keepdims=True)
    gap = np.where(lowest < luminance, luminance - lowest, 1.0)
    share = np.where(lowest < 0, np.clip(-lowest / gap, 0, 1), 0.0)
    mixed = np.clip(color + share * (luminance - color), 0, None)
    mixed[mixed < ROUNDING * mixed.max(1, keepdims=True)] = 0
    result: Float = mixed
    return result


def displayable_power(color: Float, weight: Float) -> Float:
    """Powers [N, 3] of rays, none negative, whose sum has the colour and luminance of all rays.

    Saturated rays of a white source are not each made paler: what a ray's channel lacks or has too
    much is made up by a factor on the channel, the same for all rays.

    Arguments:
        color: [N, 3] of each ray, of any sign; or [1, 3] of all.
        weight: [N] factor on it.
    """
    paler = displayable(color)
    if len(color) == 1:
        return weight[:, None] * paler
    wanted = displayable((weight @ color)[None])[0]
    found = weight @ paler
    return weight[:, None] * paler * np.divide(wanted, found, out=np.zeros(3), where=found > 0)
