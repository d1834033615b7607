"""A lamp trained from its own rays beside the one trained from its scene: floor and far field.

python -m benchmarks.ray_files [--rays 2000000] [--preset draft] [--output out/bench/ray_files]

Traces rays out of the frosted globe into a TM-25 file, trains a lamp from the scene and another
from the file, exports both, and compares them through ONNX Runtime: the irradiance of a floor 1 m
below, 2 m wide, and the intensity in directions all around. The light itself, traced anew, is the
third column. What was trained before is not trained again.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_examples.luminaires import frosted_globe
from purelight_export.export import export
from purelight_export.rays import traced_rays
from purelight_format import atomic, command
from purelight_format.color import LUMINANCE
from purelight_format.ray_file.conversion import file_of
from purelight_format.ray_file.files import write_ray_file
from purelight_mitsuba.platform import use
from purelight_onnx.lighting import irradiance
from purelight_onnx.luminaire import Luminaire
from purelight_train.light.direction_zones import zone_middles

FLOOR, SIDE, SAMPLES = 8, 2.0, 8192  # Points along an edge, metres, samples a point.
PLACES, BANDS, AROUND = 1 << 14, 12, 8
TRUE_PATHS = 1 << 24
Table = NDArray[np.float64]


def floor_of(lamp: Luminaire) -> Table:
    """Luminance-like irradiance of points of the floor: [FLOOR²]."""
    x, y, z = lamp.manifest.bounding_sphere.center
    at = (np.arange(FLOOR) + 0.5) / FLOOR * SIDE - SIDE / 2
    grid = np.stack(np.meshgrid(at, at), -1).reshape(-1, 2)
    point = np.column_stack([grid + np.array([x, y]), np.full(len(grid), z - 1.0)])
    up = np.tile([0.0, 0, 1], (len(point), 1))
    return irradiance(lamp, point, up, samples=SAMPLES, seed=1) @ LUMINANCE


def far_field_of(lamp: Luminaire) -> Table:
    """Intensity in directions in the middle of zones: [BANDS, AROUND]."""
    surface, rng = lamp.exit_surface, np.random.default_rng(2)
    triangle = rng.choice(len(surface.area), PLACES, p=surface.area / surface.area.sum())
    place = surface.point(triangle, rng.random((PLACES, 2)))
    result = []
    for direction in zone_middles(BANDS, AROUND):
        normal = surface.normal[triangle]
        cosine = normal @ direction
        normal = normal * np.sign(cosine)[:, None]
        outgoing = np.tile(direction, (PLACES, 1))
        lifted = place + 1e-5 * surface.radius * normal
        free = np.ones(PLACES, bool)
        free[surface.intersect(lifted, outgoing).ray] = False
        value = lamp.radiance(place[free], normal[free], outgoing[free]) @ LUMINANCE
        light = float((value * np.abs(cosine[free])).sum())
        result.append(light / PLACES * float(surface.area.sum()))
    return np.array(result).reshape(BANDS, AROUND)


def difference(one: Table, other: Table) -> dict[str, float]:
    """Of the sums, and the mean of that of each place, in parts."""
    weight = other / other.sum()
    return {
        "mean": round(float(one.sum() / other.sum() - 1), 4),
        "absolute": round(float((weight * np.abs(one / other - 1)).sum()), 4),
    }


def truth(scene: Path) -> tuple[Table, Table]:
    """Floor and far field of light traced anew."""
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.truth.far_field import IntensityZones
    from purelight_train.truth.plane import Plane, plane_irradiance

    luminaire = load_luminaire(scene)
    records = luminaire.trace(TRUE_PATHS, 77)
    records = records.take(records.escaped)
    plane = replace(Plane.below(luminaire.exit_surface.sphere, 1.0, SIDE), cells=FLOOR)
    floor, _ = plane_irradiance(records, plane)
    zones = IntensityZones.of(records, BANDS, AROUND)
    return (floor @ LUMINANCE).ravel(), zones.intensity @ LUMINANCE


def trained(lamp: Path, folder: Path, preset: Any) -> Luminaire:
    """A lamp trained and exported, unless it is there."""
    from purelight_train.runs.pipeline import start

    bundle = folder.with_suffix(".plux")
    if not bundle.is_file():
        start(lamp, folder, preset, 0, "cpu", resume=(folder / "config.json").is_file(),
              route="photons", anchor="straight")()  # fmt: skip
        export(folder, bundle)
    return Luminaire.open(bundle, threads=2)


def main() -> int:
    """Run the benchmark; prints the table and writes it."""
    parser = command.Parser(
        prog="python -m benchmarks.ray_files", description=__doc__.split("\n")[0]
    )
    add = parser.add_argument
    add("--rays", type=command.whole(1), default=2_000_000)
    add("--preset", default="draft")
    add("--output", type=Path, default=Path("out/bench/ray_files"))
    options = parser.parse_args()
    use()
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.presets import PRESETS

    preset, out = PRESETS[options.preset], options.output
    scene = frosted_globe.write(out / "lamp")
    rays = out / f"rays_{options.rays}.tm25ray"
    if not rays.is_file():
        write_ray_file(rays, file_of(traced_rays(load_luminaire(scene), options.rays, 5), "globe"))
    by_scene = trained(scene, out / "by_scene", preset)
    by_rays = trained(rays, out / f"by_rays_{options.rays}", preset)
    true = truth(scene)
    pairs = {"by rays, by scene": (by_rays, by_scene), "by rays, truth": (by_rays, true),
             "by scene, truth": (by_scene, true)}  # fmt: skip
    tables = {id(x): (floor_of(x), far_field_of(x)) for x in (by_rays, by_scene)}
    tables[id(true)] = true
    found = {
        name: {
            "floor": difference(tables[id(one)][0], tables[id(other)][0]),
            "far field": difference(tables[id(one)][1], tables[id(other)][1]),
        }
        for name, (one, other) in pairs.items()
    }
    print(json.dumps(found, indent=1))
    atomic.write_bytes(out / "ray_files.json", json.dumps(found, indent=1).encode())
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.ray_files", main))
