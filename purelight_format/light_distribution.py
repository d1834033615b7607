"""What `purelight-inspect` says of the light distribution of a bundle or a photometric file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.issues import plain
from purelight_format.members import PHOTOMETRY
from purelight_format.photometry.figures import PLANES, Figures
from purelight_format.photometry.files import is_photometric, read_photometry
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.luminous_part import luminous_opening
from purelight_format.photometry.reader import read_ies


def lamp_photometry(path: Path) -> LampPhotometry:
    """The light distribution of a bundle, or of an IES or EULUMDAT file.

    Raises:
        PureLightError: It cannot be read, or the bundle carries no photometry.
    """
    return read_photometry(path) if is_photometric(path) else bundle_photometry(Bundle.open(path))


def bundle_photometry(bundle: Bundle) -> LampPhotometry:
    """The light distribution that a bundle carries, and the luminous part of its exit surface."""
    if PHOTOMETRY not in bundle.entries:
        raise PureLightError(f"{bundle.path}: carries no {PHOTOMETRY}")
    surface = bundle.surface()
    opening = luminous_opening(surface.positions, surface.triangles, surface.triangle_flux)
    table = read_ies(bundle.read(PHOTOMETRY), bundle.manifest.name)
    lengthwise = 0.0 if opening.width > opening.length else 90.0
    return LampPhotometry(bundle.manifest.name, table, opening, lengthwise=lengthwise)


def photometry_json(lamp: LampPhotometry) -> dict[str, Any]:
    """The figures of a photometric file."""
    return {
        "name": plain(lamp.name),
        "figures": asdict(Figures.of(lamp.table)),
        "opening": asdict(lamp.opening),
        "lamp_lumens": lamp.lamp_lumens,
        "watts": lamp.watts,
        "notes": list(lamp.notes),
    }


def photometry_text(lamp: LampPhotometry) -> str:
    """The same for people."""
    figures, opening = Figures.of(lamp.table), lamp.opening
    toward = f"{figures.toward[0]:g} degrees from nadir, C{figures.toward[1]:g}"
    beams = ", ".join(f"{figures.beam[n]:.1f} ({n})" for n, _ in PLANES)
    sizes = (opening.width, opening.length, opening.heights[0])
    sides = " x ".join(f"{1e3 * x:.4g}" for x in sizes)
    body = "a point" if opening.is_point else f"{sides} mm, {opening.shape}"
    lines = [
        plain(lamp.name),
        f"light         {figures.flux:.5g} lm, {100 * figures.downward:.1f} % downwards"
        + (f"; lamps {lamp.lamp_lumens:.5g} lm" if lamp.lamp_lumens else "")
        + (f"; {lamp.watts:g} W" if lamp.watts else ""),
        f"peak          {figures.peak:.5g} cd, {toward}",
        f"beam angle    {beams} degrees",
        f"opening       {body}",
        *(f"note          {plain(note)}" for note in lamp.notes),
    ]
    return "\n".join(lines)
