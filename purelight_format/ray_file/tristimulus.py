"""The colour and power of stored rays, from whichever columns and spectra a file has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.ray_file.ray_file import RayFile
from purelight_format.ray_file.spectra import (
    displayable_power,
    rgb,
    spectrum_xyz,
    wavelength_xyz,
)

Float = NDArray[np.float64]
WHITE = np.ones((1, 3))


@dataclass(frozen=True)
class Colors:
    """Linear Rec.709 of rays, of any sign, and a factor on each.

    Arguments:
        color: [N, 3] or [1, 3].
        weight: [N].
        told: how the colours came about.
    """

    color: Float
    weight: Float
    told: str

    @staticmethod
    def of(file: RayFile, rows: NDArray[np.float32]) -> Colors:
        """Of some rows of a file: by tristimulus values, luminous flux, or radiant flux.

        Luminous flux gets the colour of the wavelength or the spectrum of all rays if there is one,
        else white. Radiant flux needs a spectrum, or a header that tells lumens and watts; else a
        watt counts as one in each channel.
        """
        columns = {name: rows[:, k].astype(np.float64) for k, name in enumerate(file.columns)}
        if {"X", "lumens", "Z"} <= columns.keys():
            xyz = np.stack([columns[name] for name in ("X", "lumens", "Z")], 1) / LUMENS_PER_WATT
            return Colors(rgb(xyz), _sound(np.ones(len(rows))), "colours by tristimulus values")
        watt, told = _of_a_watt(file, columns)
        if "lumens" in columns:
            color = _of_unit_luminance(watt)
            return Colors(color, _sound(columns["lumens"] / LUMENS_PER_WATT), told)
        return Colors(watt, _sound(columns["watts"]), told)

    def power(self) -> tuple[Float, str]:
        """Power of each ray in W per channel, [N, 3], and words about it."""
        color = np.where(np.isfinite(self.color), self.color, 0)
        return displayable_power(color, self.weight), self.told


def _sound(flux: Float) -> Float:
    return np.where(np.isfinite(flux) & (flux > 0), flux, 0)


def _of_a_watt(file: RayFile, columns: dict[str, Float]) -> tuple[Float, str]:
    """Linear Rec.709 of a watt of each ray, [N, 3] or [1, 3], and how it came about."""
    if "wavelength" in columns:
        nanometres = np.nan_to_num(columns["wavelength"]) * file.nanometres
        return _visible(file, rgb(wavelength_xyz(nanometres))), "colours by each ray's wavelength"
    if "spectrum" in columns and file.spectra:
        table = np.array([spectrum_xyz(*map(_double, spectrum)) for spectrum in file.spectra])
        place = np.nan_to_num(columns["spectrum"], nan=0.0).clip(0, len(table))
        chosen = np.where(place >= 1, place - 1, 0).astype(np.int64)
        return _visible(file, rgb(table)[chosen]), "colours by each ray's spectrum"
    if file.spectra:
        xyz = spectrum_xyz(*map(_double, file.spectra[0]))
        return _visible(file, rgb(xyz)[None]), "colour by the spectrum of all rays"
    if file.wavelength:
        xyz = wavelength_xyz(np.array([file.wavelength]))
        return _visible(file, rgb(xyz)), f"colour by the wavelength, {file.wavelength:g} nm"
    lumens, watts = (file.stated.get(name, 0.0) for name in ("lumens", "watts"))
    if "watts" in columns and lumens > 0 and watts > 0:
        told = f"no colour: white, {lumens / watts:.4g} lm of a watt as its header says"
        return WHITE * lumens / watts / LUMENS_PER_WATT, told
    if "lumens" in columns:
        return WHITE, "no colour: white"
    return WHITE, "no colour: white, with as many watts in each channel, 683 lm of a watt"


def _of_unit_luminance(color: Float) -> Float:
    """The same hues with a luminance of one; white where there is none."""
    luminance = (color @ LUMINANCE)[:, None]
    return np.where(luminance > 0, color / np.where(luminance > 0, luminance, 1), 1.0)


def _double(values: NDArray[np.float32]) -> Float:
    return values.astype(np.float64)


def _visible(file: RayFile, color: Float) -> Float:
    if not np.abs(color).max(initial=0) > 0:
        raise PureLightError(f"{file.name}: its light is invisible: below 360 or above 830 nm")
    return color
