"""Trains a tiny cube with the network of docs/add_a_network.md, exports it, and measures it.

Its last line is what was found, as JSON; lamp.plux lies in the working directory.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

import purelight_format
from purelight_conformance import maker, runner
from purelight_export.export import export
from purelight_format.validation.validate import validate
from purelight_mitsuba import platform
from purelight_onnx.exit_surface import ExitSurface
from purelight_onnx.luminaire import Luminaire
from purelight_train.presets import DRAFT, Optimisation

CUBE = """<scene version="3.0.0"><shape type="cube">
  <transform name="to_world"><scale value="0.05"/><translate x="0.02" z="0.1"/></transform>
  <bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="3,2,1"/></emitter>
</shape></scene>"""
FEW = Optimisation(30, 1 << 8, 1e-2)
TINY = dataclasses.replace(
    DRAFT, name="tiny", paths=1 << 18, photons=FEW, cap_points=1 << 7, sampler=FEW, fast_map=FEW,
    transparency_samples=1 << 16, transparency=Optimisation(500, 1 << 11, 1e-2),
)  # fmt: skip


def train(folder: Path) -> None:
    """A lamp that is quickly traced, and that learns little but its depth."""
    platform.use("llvm_ad_rgb")
    from purelight_train.runs.pipeline import start

    (folder / "cube.xml").write_text(CUBE)
    start(folder / "cube.xml", folder / "run", TINY, 0, "cpu", resume=False, route="photons")(
        judged=False
    )


def rays(lamp: Luminaire, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from 1.5 to 10 radii away, at points in the bounding sphere: origins, directions."""
    rng, sphere = np.random.default_rng(1), lamp.manifest.bounding_sphere
    ends = rng.normal(size=(2, count, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    ends *= np.stack((rng.uniform(1.5, 10, count), np.cbrt(rng.random(count))))[..., None]
    origin, target = np.array(sphere.center) + sphere.radius * ends
    toward = target - origin
    return origin, toward / np.linalg.norm(toward, axis=1, keepdims=True)


def measure(lamp: Luminaire) -> dict[str, float]:
    """Mean errors in radii: where rays meet the lamp, where they pass it, where they go away."""
    point, toward = rays(lamp, 4096)
    sphere = lamp.manifest.bounding_sphere
    depth = lamp.evaluate("depth", point=point, toward=toward)["depth"]
    hits = ExitSurface(lamp.bundle.surface(), sphere).intersect(point, toward)
    true = np.linalg.norm(hits.position - point[hits.ray], axis=1) / sphere.radius
    offset = (point - sphere.center) / sphere.radius
    middle = -(offset * toward).sum(1)
    half = np.sqrt(1 - np.maximum((offset**2).sum(1) - middle**2, 0))
    passing = np.setdiff1d(np.arange(len(point)), hits.ray)
    away = lamp.evaluate("depth", point=point, toward=-toward)["depth"]
    return {
        "error": float(np.abs(depth[hits.ray] - true).mean()),
        "error_of_sphere": float(np.abs((middle - half)[hits.ray] - true).mean()),
        "passing": float(np.abs(depth - middle - half)[passing].mean()),
        "missing": float(np.abs(away).max()),
    }


def main() -> None:
    train(Path())
    export("run", "lamp.plux")
    lamp = Luminaire.open("lamp.plux")
    host = [sys.executable, "-m", "purelight_onnx.conformance_host"]
    found = {
        "conforms": runner.run(maker.of_bundle(lamp.bundle), host, timeout=120).conforms,
        "code": purelight_format.__file__,
        "issues": [issue.code for issue in validate("lamp.plux").issues],
        "networks": list(lamp.manifest.networks),
        **measure(lamp),
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
