"""Polar diagrams of light distributions side by side, as an SVG picture."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from purelight_format.issues import plain
from purelight_format.photometry.figures import PLANES, profile
from purelight_format.photometry.lamp_photometry import LampPhotometry

SIZE, MARGIN, RADIUS = 420, 50, 150  # Of one diagram, in pixels.
RINGS = 4
STEP = 1.0  # Degrees.
COLORS = ("#c2410c", "#0369a1")  # Of the two planes.


def polar_plot(lamps: Sequence[LampPhotometry]) -> str:
    """The two main planes of each lamp on one scale: nadir below, C0 and C90 on the right."""
    largest = max(float(lamp.table.candela.max(initial=0)) for lamp in lamps)
    ring = _round_up(largest / RINGS)
    parts = [
        f'<g transform="translate({SIZE * k} 0)">{_diagram(lamp, ring)}</g>'
        for k, lamp in enumerate(lamps)
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE * len(lamps)} {SIZE}" '
        'font-family="sans-serif" font-size="11" fill="#475569">'
        f'<rect width="100%" height="100%" fill="#fff"/>{"".join(parts)}</svg>\n'
    )


def _diagram(lamp: LampPhotometry, ring: float) -> str:
    middle = (SIZE / 2, MARGIN + RADIUS + 20)
    title = escape(plain(lamp.name, 48))
    heading = f'<text x="{SIZE / 2}" y="22" text-anchor="middle" font-size="14">{title}</text>'
    flux = f'<text x="{SIZE / 2}" y="40" text-anchor="middle">{lamp.table.flux:.5g} lm</text>'
    curves = [
        _curve(lamp, plane, ring, middle, color)
        for (_, plane), color in zip(PLANES, COLORS, strict=True)
    ]
    legend = [
        f'<text x="{60 + 160 * k}" y="{SIZE - 12}" fill="{color}">{name}</text>'
        for k, ((name, _), color) in enumerate(zip(PLANES, COLORS, strict=True))
    ]
    return "".join([heading, flux, _grid(ring, middle), *curves, *legend])


def _grid(ring: float, middle: tuple[float, float]) -> str:
    x, y = middle
    parts = []
    for k in range(1, RINGS + 1):
        radius = RADIUS * k / RINGS
        parts.append(f'<circle cx="{x}" cy="{y}" r="{radius}" fill="none" stroke="#cbd5e1"/>')
        parts.append(f'<text x="{x + 3}" y="{y + radius - 3:.1f}">{k * ring:g}</text>')
    for angle in range(0, 360, 30):
        a = np.radians(angle)
        end = f'x2="{x + RADIUS * np.sin(a):.1f}" y2="{y + RADIUS * np.cos(a):.1f}"'
        parts.append(f'<line x1="{x}" y1="{y}" {end} stroke="#e2e8f0"/>')
    parts.append(f'<text x="{x - RADIUS - 34}" y="{y + 4}">cd</text>')
    return "".join(parts)


def _curve(
    lamp: LampPhotometry, plane: float, ring: float, middle: tuple[float, float], color: str
) -> str:
    angle, value = profile(lamp.table, plane, STEP)
    radius = value / (ring * RINGS) * RADIUS
    x = middle[0] + radius * np.sin(np.radians(angle))
    y = middle[1] + radius * np.cos(np.radians(angle))
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polygon points="{points}" fill="none" stroke="{color}" stroke-width="1.6"/>'


def _round_up(value: float) -> float:
    """The next of 1, 2, 2.5, 5 times a power of ten; 1 for nothing."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 2.5, 5, 10) if step * power >= value * 0.999))
