"""Light distributions made by formulas, and the same as photometric text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.opening import Opening
from purelight_format.photometry.table import IntensityTable

VERTICAL = np.linspace(0, 180, 37)
FULL = np.linspace(0, 360, 25)


def skewed(horizontal: np.ndarray = FULL, kind: int = 0) -> IntensityTable:
    """A lobe with the symmetry of an EULUMDAT number."""
    theta, phi = np.radians(VERTICAL), np.radians(horizontal)[:, None]
    along, across = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    x = {0: along, 1: 0 * along, 2: along, 3: along**2, 4: along**2}[kind]
    y = {0: across, 1: 0 * across, 2: across**2, 3: across, 4: across**2}[kind]
    values = 500 * np.exp(0.4 * x + 0.7 * y - np.cos(theta) * -0.8) * (np.cos(theta) > -0.9)
    return IntensityTable(VERTICAL, horizontal, np.round(values, 3))


def lamp(table: IntensityTable | None = None) -> LampPhotometry:
    """A lamp of a few hundred candela with a rectangular opening."""
    return LampPhotometry(
        "Lamp", table or skewed(), Opening(0.3, 1.2, (0.0, 0.01, 0.02, 0.03)), watts=40.0
    )  # fmt: skip


def lambertian(flux: float, opening: Opening) -> LampPhotometry:
    """A lamp that glows evenly downwards."""
    values = flux / np.pi * np.cos(np.radians(VERTICAL)).clip(0)
    return LampPhotometry(
        "Lambertian", IntensityTable(VERTICAL, np.zeros(1), values[None]), opening
    )


def ies(
    table: IntensityTable,
    *,
    head: Sequence[str] = ("IES:LM-63-2019", "[LUMINAIRE] Lamp"),
    tilt: str = "NONE",
    kind: int = 1,
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0),
    units: int = 2,
    size: str = "0.3 1.2 0.1",
) -> str:
    """IES text of a table.

    Arguments:
        factors: multiplier, ballast factor, and what follows it.
    """
    multiplier, ballast, extra = factors
    lines = [
        *head, f"TILT={tilt}",
        f"1 -1 {multiplier} {len(table.vertical)} {len(table.horizontal)} {kind} {units} {size}",
        f"{ballast} {extra} 40",
    ]  # fmt: skip
    for row in (table.vertical, table.horizontal, *table.candela):
        lines.append(" ".join(f"{x:.9g}" for x in row))
    return "\n".join(lines) + "\n"
