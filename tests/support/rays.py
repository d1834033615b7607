"""Rays made by formulas, and ray files packed byte by byte from the published layouts."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from purelight_format.ray_file.rays import Rays

NAN = b"\x00\x00\xa0\x7f"  # A signalling one, as the format wants it.


def disc(count: int = 20_000, radius: float = 2e-3, seed: int = 0) -> Rays:
    """A disc at z = 0 that glows upwards like paper, of 1, 0.5 and 0 W."""
    rng = np.random.default_rng(seed)
    position = np.zeros((count, 3), np.float32)
    angle, place = 2 * np.pi * rng.random(count), radius * np.sqrt(rng.random(count))
    position[:, 0], position[:, 1] = place * np.cos(angle), place * np.sin(angle)
    power = np.tile(np.array([1, 0.5, 0], np.float32) / count, (count, 1))
    return Rays(position, _cosine(np.array([0.0, 0, 1]), count, rng), power)


def ball(
    count: int = 20_000, radius: float = 0.05, centre: Sequence[float] = (0.1, 0.2, 0.3),
    away: float = 0.0, seed: int = 0,
) -> Rays:  # fmt: skip
    """A ball that glows like paper, of 3, 2 and 1 W.

    Arguments:
        away: how far the rays have gone from its surface.
    """
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    direction = _cosine(normal, count, rng)
    position = np.asarray(centre) + radius * normal + away * direction
    power = np.tile(np.array([3, 2, 1], np.float32) / count, (count, 1))
    return Rays(position.astype(np.float32), direction, power)


def _cosine(
    normal: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.float32]:
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    direction += normal * 1.000001
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction.astype(np.float32)


def tm25(
    rows: NDArray[np.float32], flags: Sequence[int], *, spectral: int = 0, wavelength: float = 0.0,
    lumens: float | None = None, watts: float | None = None,
    spectra: Sequence[Sequence[tuple[float, float]]] = (), labels: Sequence[str] = (),
    text: str = "", version: int = 2013, count: int | None = None, name: str = "LED",
) -> bytes:  # fmt: skip
    """A TM-25 file.

    Arguments:
        rows: [N, columns].
        flags: position, direction, radiant flux, wavelength, luminous flux, Stokes, tristimulus,
            spectrum.
        count: what the header says of the rays, the truth by default.
    """
    one = [struct.pack("<f", x) if x is not None else NAN for x in (lumens, watts)]
    lines = text.ljust(-(-len(text) // 8) * 8, "\0").encode("utf-32-le")
    head = b"TM25" + struct.pack("<ii", version, 0) + one[0] + one[1]
    head += struct.pack("<Q", len(rows) if count is None else count)
    head += b"2026-01-01T00:00:00+01:00".ljust(28, b"\0") + struct.pack("<ii", 0, spectral)
    head += (struct.pack("<f", wavelength) if wavelength else NAN) + NAN + NAN
    head += struct.pack("<iii", len(spectra), len(labels), len(lines)) + bytes(168)
    texts = [name, *["unknown"] * 8]
    body = struct.pack("<8i", *flags)
    body += b"".join(t.ljust(1000, "\0").encode("utf-32-le") for t in texts)
    tables = b"".join(
        struct.pack(f"<i{2 * len(s)}f", len(s), *(x for pair in s for x in pair)) for s in spectra
    )
    body += tables + bytes(-len(tables) % 32)
    body += b"".join(label.ljust(128, "\0").encode("utf-32-le") for label in labels) + lines
    return head + body + rows.astype("<f4").tobytes()


def zemax(
    rows: NDArray[np.float32], *, unit: int = 4, kind: int = 0, flux_kind: int = 0,
    flux: float = 0.0, wavelength: float = 0.0, count: int | None = None,
) -> bytes:  # fmt: skip
    """A binary source file of Zemax."""
    head = struct.pack("<iI100s", 1010, len(rows) if count is None else count, b"LED")
    head += struct.pack("<3f4f", flux, flux, wavelength, 0, 0, 0, 0)
    head += struct.pack("<I3f3f3f4f", unit, *[0.0] * 13)
    head += struct.pack("<4i", kind, flux_kind, 0, 0)
    return head + rows.astype("<f4").tobytes()


def geometry(rays: Rays) -> NDArray[np.float32]:
    """Positions in millimetres, and directions: [N, 6]."""
    return np.concatenate([rays.position * 1e3, rays.direction], 1).astype(np.float32)
