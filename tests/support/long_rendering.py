"""Renderings of many samples and of many lamps, for a process that does nothing else."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np

from purelight_mitsuba import use

PLACES = [(x, y) for x in np.linspace(-1, 1, 10) for y in np.linspace(-1, 1, 10)]


def peak_megabytes(bundle: Path, engine: str) -> float:
    """The most memory in MiB that the process has had, once pictures are drawn and looked at."""
    mi = use()
    import drjit as dr

    from tests.support.analytic_lamps import room

    def lamp(x: float, y: float, z: float, scale: float) -> dict[str, object]:
        to_world = mi.ScalarTransform4f().translate([x, y, z]).scale(scale)
        return {"type": "purelight", "filename": str(bundle), "to_world": to_world}

    hall = {f"l{k}": lamp(x, y, 0.5, 0.2) for k, (x, y) in enumerate(PLACES)}
    integrator = {"type": "purelight", "engine": engine, "max_depth": 4}
    for lit, spp in ((hall, 64), ({"l": lamp(0.1, 0.2, 0.3, 1)}, 4096)):
        scene = mi.load_dict(room() | lit)
        image = np.array(mi.render(scene, integrator=mi.load_dict(integrator), spp=spp))
        assert np.isfinite(image).all()
        assert image.mean() > 0.01
    dr.flush_malloc_cache()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
