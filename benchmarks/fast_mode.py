"""Fast mode beside accurate mode: noise, light and time, in rooms and close to the lamp.

python -m benchmarks.fast_mode --lamp a.plux [b.plux ...] [--output out/bench]
    [--places room floor ...] [--engines auto] [--spp 16] [--passes 16]

Each lamp hangs in the demo's room, in three ways in the closed room of `closed_room`, and just
above a floor that is matt or brushed metal; one that is too large is made smaller. Both modes
render the same pixels, those that see the lamp itself left out, in as many independent passes. A
pixel's relative variance is that of one pass over its squared mean light. Its mean over the pixels
is told twice: of all, and of all but the noisiest hundredth, since few bright outliers can outweigh
the rest; the ratio of the latter has its standard error. Time is that of the processor, without
compilation.
"""

from __future__ import annotations

import json
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import closed_room
from purelight_examples.luminaires.lamp_scene import Material, Part, write_parts, write_xml
from purelight_examples.scenes import room
from purelight_examples.scenes.furniture import wall
from purelight_examples.scenes.lamp_choice import NeuralLamp, Point
from purelight_examples.scenes.sensor import Picture, sensor
from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere
from purelight_mitsuba.scene_file import load_scene

SIZE = 128
LARGEST = 0.1  # Metres; lamps of larger bounding spheres are scaled to it.
FLOORS = {  # Radii below the lamp's centre, and material.
    "floor": (1.02, Material("diffuse", {}, {"reflectance": (0.5, 0.5, 0.5)})),
    "gloss": (1.5, Material("roughconductor", {"material": "none", "alpha": 0.1}, {})),
}
OUTLIERS = 0.01  # Of the pixels, the noisiest.
DARK = 0.01  # Of the mean light; pixels darker than this count as if they had it.
MODES = ("accurate", "fast")
Figures = dict[str, Any]


@dataclass(frozen=True)
class Place:
    """Where a lamp hangs.

    Arguments:
        write: Writes the scene into a folder; returns its XML.
        sphere: The lamp's bounding sphere in it.
    """

    write: Callable[[Path], Path]
    sphere: BoundingSphere


def places(bundle: Path) -> dict[str, Place]:
    """The demo's room, the closed room's mountings, and floors near the lamp."""
    own = Bundle.open(bundle).manifest.bounding_sphere
    scale = min(1.0, LARGEST / own.radius)
    lamp, radius = NeuralLamp(bundle.resolve(), scale=scale), scale * own.radius
    middle = scale * np.array(own.center)
    picture = Picture(SIZE, SIZE)

    def mounted(centre: np.ndarray, write: Callable[[Path, Point], Path]) -> Place:
        """A scene that is written with the lamp's own origin where it puts the sphere there."""
        at = (*(centre - middle).tolist(),)
        return Place(lambda folder: write(folder, at), BoundingSphere((*centre.tolist(),), radius))

    hung = np.array(room.LAMP_AT) + middle
    result = {"room": mounted(hung, lambda folder, _: room.write(folder, lamp, picture))}
    for name, mounting in closed_room.mountings(radius).items():
        write = partial(_closed, lamp=lamp, name=name, target=mounting.target)
        result[name] = mounted(np.array(mounting.centre), write)
    for name in FLOORS:
        write = partial(_floor, lamp=lamp, name=name, radius=radius)
        result[name] = mounted(np.zeros(3), write)
    return result


def _closed(folder: Path, at: Point, *, lamp: NeuralLamp, name: str, target: Point) -> Path:
    return closed_room.write_room(folder, name, lamp, at, target)


def _floor(folder: Path, at: Point, *, lamp: NeuralLamp, name: str, radius: float) -> Path:
    """A floor below the lamp, whose sphere is about the origin, seen from one side."""
    below, material = FLOORS[name]
    height, half = -below * radius, 6 * radius
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    eye = (-7 * radius, 0.0, 4 * radius)
    scene.append(sensor(Picture(SIZE, SIZE), eye, (0.0, 0.0, height), 55))
    plane = Part(name, wall((0, 0, height), 3, (half, half)), material)
    scene.extend(write_parts(folder, "bare", [plane]))
    scene.extend(lamp.elements(folder, at))
    return write_xml(folder / f"{name}.xml", scene)


def compare(
    bundle: Path,
    folder: Path,
    *,
    names: Sequence[str] = (),
    engine: str = "auto",
    spp: int = 16,
    passes: int = 16,
) -> Figures:
    """Figures of both modes by place (`figures_of`); Mitsuba's variant must be set.

    Arguments:
        bundle: The lamp.
        folder: For the scenes.
        names: Some of `places`; by default all.
        engine: Of the integrator.
        spp: Samples per pixel of one pass.
        passes: Independent ones, at least two.
    """
    folder.mkdir(parents=True, exist_ok=True)
    result = {}
    for name, place in places(bundle).items():
        if names and name not in names:
            continue
        scene = load_scene(place.write(folder))
        clear = beside(scene, place.sphere)
        modes = {mode: _rendered(scene, mode, engine, spp, passes) for mode in MODES}
        result[name] = figures_of(modes, clear)
    return result


def beside(scene: Any, sphere: BoundingSphere) -> np.ndarray:
    """Pixels [SIZE, SIZE] whose rays pass the bounding sphere and meet the room."""
    import mitsuba as mi

    grid = (np.stack(np.meshgrid(*2 * [np.arange(SIZE)]), -1).reshape(-1, 2) + 0.5) / SIZE
    point = mi.Point2f(np.ascontiguousarray(grid.T, np.float32))
    ray, _ = scene.sensors()[0].sample_ray(0, 0.5, point, 0.5)
    met = np.array(scene.ray_intersect(ray).is_valid())
    origin, direction = (np.array(v, np.float64).T for v in (ray.o, ray.d))
    toward = np.array(sphere.center) - origin
    along = (toward * direction).sum(1)
    off = np.linalg.norm(toward - along[:, None] * direction, axis=1)
    return (met & (off > 1.1 * sphere.radius)).reshape(SIZE, SIZE)


@dataclass(frozen=True)
class Rendered:
    """Pictures of independent passes [P, H, W, 3], and processor seconds of all."""

    passes: np.ndarray
    seconds: float


def _rendered(scene: Any, mode: str, engine: str, spp: int, passes: int) -> Rendered:
    import mitsuba as mi

    made = mi.load_dict({"type": "purelight", "mode": mode, "engine": engine})
    np.array(mi.render(scene, integrator=made, spp=spp, seed=0))  # Compiles.
    start, pictures = time.process_time(), []
    for seed in range(passes):
        picture = mi.render(scene, integrator=made, spp=spp, seed=seed + 1)
        pictures.append(np.array(picture, np.float64)[..., :3])
    return Rendered(np.array(pictures), time.process_time() - start)


def figures_of(modes: dict[str, Rendered], clear: np.ndarray) -> Figures:
    """Noise, light and time of both modes, and fast mode's over accurate mode's.

    Arguments:
        modes: Renderings by mode.
        clear: Pixels that count, [H, W].
    """
    light = {mode: rendered.passes[:, clear] for mode, rendered in modes.items()}
    square = (sum(passes.mean(0) for passes in light.values()) ** 2).mean(-1) / len(modes) ** 2
    square += DARK**2 * square.mean()
    result: Figures = {
        mode: {
            **_noise(light[mode], square),
            "seconds": modes[mode].seconds,
            "mean": float(light[mode].mean()),
        }
        for mode in MODES
    }
    accurate, fast = (result[mode] for mode in MODES)
    error = np.hypot(*(result[mode].pop("standard_error") for mode in MODES))
    ratio = {key: fast[key] / accurate[key] for key in fast}
    for key in ("relative_variance", "without_outliers"):
        ratio[f"{key}_at_equal_time"] = ratio[key] * ratio["seconds"]
    result["fast_over_accurate"] = ratio | {
        "standard_error": float(error * ratio["without_outliers"])
    }
    return result


def _noise(passes: np.ndarray, square: np.ndarray) -> Figures:
    """Mean relative variance of all pixels; without outliers, and its relative error by jackknife.

    Arguments:
        passes: Pictures [P, N, 3].
        square: Mean light of a pixel, squared, [N].
    """
    noise = passes.var(0, ddof=1).mean(-1) / square
    kept = np.argsort(noise)[: len(noise) - int(OUTLIERS * len(noise))]
    inner, weight = passes[:, kept], 1 / square[kept]
    parts = [
        (np.delete(inner, k, 0).var(0, ddof=1).mean(-1) * weight).mean() for k in range(len(inner))
    ]
    mean = noise[kept].mean()
    return {
        "relative_variance": float(noise.mean()),
        "without_outliers": float(mean),
        "standard_error": float(np.std(parts) * np.sqrt(len(parts) - 1) / mean),
    }


def table(results: dict[str, dict[str, Figures]]) -> str:
    """The figures of all lamps as text."""
    lines = [
        f"{'':32}{'relative variance':>19}{'fast / accurate':>22}{'at equal time':>15}"
        f"{'seconds':>15}{'light':>8}",
        f"{'':32}{'accurate':>10}{'fast':>9}{'99 %':>16}{'all':>6}{'99 %':>9}{'all':>6}"
        f"{'accurate':>10}{'fast':>6}{'ratio':>7}",
    ]
    for lamp, found in results.items():
        for place, figures in found.items():
            accurate, fast, ratio = (figures[k] for k in (*MODES, "fast_over_accurate"))
            lines.append(
                f"{lamp[-21:] + ' ' + place:32}"
                f"{accurate['without_outliers']:10.4f}{fast['without_outliers']:9.4f}"
                f"{ratio['without_outliers']:8.2f} +- {ratio['standard_error']:4.2f}"
                f"{ratio['relative_variance']:6.2f}"
                f"{ratio['without_outliers_at_equal_time']:9.2f}"
                f"{ratio['relative_variance_at_equal_time']:6.2f}"
                f"{accurate['seconds']:10.1f}{fast['seconds']:6.1f}{ratio['mean']:7.3f}"
            )
    return "\n".join(lines)


def main() -> int:
    """Measure all lamps, print the table and write OUTPUT/fast_mode.json."""
    parser = command.Parser(prog="python -m benchmarks.fast_mode", description=__doc__)
    parser.add_argument("--lamp", type=Path, nargs="+", required=True, help=".plux bundles")
    parser.add_argument("--output", type=Path, default=Path("out/bench"))
    parser.add_argument("--places", nargs="+", default=(), help="some of room pendant ...")
    parser.add_argument("--engines", nargs="+", default=["auto"])
    parser.add_argument("--spp", type=command.whole(1), default=16, help="of one pass")
    parser.add_argument("--passes", type=command.whole(1), default=16)
    arguments = parser.parse_args()
    from purelight_mitsuba import use

    use()
    results: dict[str, dict[str, Figures]] = {}
    for lamp in arguments.lamp:
        for engine in arguments.engines:
            name = f"{lamp.with_suffix('')} {engine}"
            print(f"{name} ...", file=sys.stderr, flush=True)
            results[name] = compare(
                lamp, arguments.output / "fast_mode", names=arguments.places, engine=engine,
                spp=arguments.spp, passes=arguments.passes,
            )  # fmt: skip
    text = json.dumps(results, indent=2) + "\n"
    atomic.write_bytes(arguments.output / "fast_mode.json", text.encode())
    print(table(results))
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.fast_mode", main))
