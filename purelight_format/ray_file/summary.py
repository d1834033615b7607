"""A few lines about a ray file."""

from __future__ import annotations

from typing import Any

import numpy as np

from purelight_format.issues import plain
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.ray_file import RayFile

MOST = 1 << 21  # Rays that are looked at.


def ray_summary_json(file: RayFile) -> dict[str, Any]:
    """What a file holds, and what its rays sum up to."""
    rays = rays_of(file, MOST)
    low, high = rays.position.min(0), rays.position.max(0)
    return {
        "name": plain(file.name),
        "rays": len(file),
        "columns": list(file.columns),
        "stated": dict(file.stated),
        "totals": file.totals(),
        "lumens": rays.lumens,
        "flux": rays.flux.tolist(),
        "colors": rays.colors,
        "start": [low.tolist(), high.tolist()],
        "upwards": float((rays.power[rays.direction[:, 2] > 0]).sum() / rays.power.sum()),
        "relative_error": float(np.sqrt((rays.power.sum(1) ** 2).sum()) / rays.power.sum()),
        "notes": list(rays.notes),
    }


def ray_summary_text(file: RayFile) -> str:
    """The same for people."""
    about = ray_summary_json(file)
    low, high = (np.array(corner) * 1e3 for corner in about["start"])
    totals = ", ".join(f"{value:.5g} {name}" for name, value in about["totals"].items())
    stated = ", ".join(f"{value:.5g} {name}" for name, value in about["stated"].items())
    size = " x ".join(f"{x:.4g}" for x in high - low)
    lines = [
        f"{about['name']}: {about['rays']:,} rays",
        f"light         {about['lumens']:.5g} lm, {100 * about['upwards']:.1f} % upwards; known "
        f"within {100 * about['relative_error']:.2g} % by its count",
        f"flux          {totals}; its header says {stated or 'nothing'}",
        f"colours       {about['colors']}",
        f"start         within {size} mm, from z = {low[2]:.4g} to {high[2]:.4g} mm",
        *(f"note          {plain(note)}" for note in about["notes"]),
    ]
    return "\n".join(lines)
