"""Stored rays in the units of the format, and back."""

from __future__ import annotations

import numpy as np

from purelight_format.color import LUMENS_PER_WATT
from purelight_format.errors import PureLightError
from purelight_format.ray_file.ray_file import LUMENS, PLACE, TOWARD, RayFile
from purelight_format.ray_file.rays import Rays
from purelight_format.ray_file.spectra import RGB_TO_XYZ
from purelight_format.ray_file.tristimulus import Colors

MOST = 1 << 24  # Rays that are held in memory: 600 MB.


def rays_of(file: RayFile, most: int = MOST, seed: int = 0) -> Rays:
    """The rays of a file in the units of the format.

    Of more than `most` rays, that many are drawn and stand for all. Rays with a number that is not
    finite, or without direction or light, are left out.

    Raises:
        PureLightError: None is left.
    """
    rows, share = file.rows, 1.0
    notes = [*file.notes, *file.flux_notes()]
    if len(file) > most:
        drawn = np.random.default_rng(seed).choice(len(file), most, replace=False)
        rows, share = file.rows[np.sort(drawn)], len(file) / most
        notes.append(f"{most} of {len(file)} rays, drawn at random, stand for all")
    power, told = Colors.of(file, rows).power()
    length = np.linalg.norm(rows[:, 3:6].astype(np.float64), axis=1)
    with np.errstate(invalid="ignore"):
        sound = np.isfinite(rows[:, :6]).all(1) & (length > 0) & (power.sum(1) > 0)
    if not sound.any():
        raise PureLightError(f"{file.name}: no ray of it carries light")
    if not sound.all():
        notes.append(f"{int((~sound).sum())} rays without light or direction are left out")
    return Rays(
        (rows[sound, :3].astype(np.float64) * file.metres).astype(np.float32),
        (rows[sound, 3:6] / length[sound, None]).astype(np.float32),
        (power[sound] * share).astype(np.float32),
        told,
        tuple(notes),
    )


def file_of(rays: Rays, name: str) -> RayFile:
    """A file with luminous flux and tristimulus values of each ray, in lm and in millimetres."""
    xyz = LUMENS_PER_WATT * rays.power.astype(np.float64) @ RGB_TO_XYZ.T
    millimetres = rays.position.astype(np.float64) * 1e3
    rows = np.concatenate([millimetres, rays.direction, xyz[:, [1, 0, 2]]], 1)
    columns = (*PLACE, *TOWARD, LUMENS, "X", "Z")
    return RayFile(name, columns, rows.astype(np.float32), stated={LUMENS: rays.lumens})
