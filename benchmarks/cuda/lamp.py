"""A small lamp without training, for a machine that has none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from purelight_conformance.lamps import LAMPS
from purelight_format import bundle
from purelight_format.members.surface import Surface


def write(path: Path) -> Path:
    """The conformance suite's lamp of random weights, all five networks, on a closed octahedron.

    The suite's own octahedron has a face twice; which of both a ray meets is chance.
    """
    whole = LAMPS["wild"].write(path)
    members = {
        name: whole.read(name) for name in whole.manifest.members if not name.endswith(".usda")
    }
    surface = closed(whole.surface(), np.array(whole.manifest.bounding_sphere.center))
    flux = np.array(whole.manifest.flux) / surface.triangle_flux.astype(np.float64).sum(0)
    surface = replace(surface, triangle_flux=(surface.triangle_flux * flux).astype(np.float32))
    bundle.write(path, whole.manifest, members | surface.to_members())
    return path


def closed(surface: Surface, centre: np.ndarray) -> Surface:
    """The first eight triangles, turned outward."""
    triangles = surface.triangles[:8].copy()
    a, b, c = (surface.positions.astype(np.float64)[triangles[:, k]] - centre for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return Surface(surface.positions, triangles, surface.triangle_flux[:8])
