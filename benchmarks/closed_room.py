"""A lamp in a closed room against the real lamp, light traced: error of the whole picture.

python -m benchmarks.closed_room --bundle lamp.plux --lamp lamp.xml [--output out/bench]

The room is matt, so that light tracing meets every pixel but those that see the lamp itself, which
are left out. The lamp hangs free, a wall passes through its bounding sphere, or it is in a recess.
With --path-spp, the real lamp is path traced too, and the table says how many times as long that
takes to the same error: its mean square error falls as 1 / time, so this is the quotient of both
products of error and time. It is too small where the samples taken missed bright paths.

With --reflectance 0.01 all surfaces reflect a hundredth of what they do, and the picture shows the
lamp's light alone: what a neural lamp lacks near a white wall besides is what the real one
reflects of the room's light.
"""

from __future__ import annotations

import itertools
import json
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import Part, matt, write_parts, write_xml
from purelight_examples.scenes.furniture import boxes, wall
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp, Point, RealLamp, move
from purelight_examples.scenes.sensor import Picture, sensor
from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere
from purelight_mitsuba.scene_file import load_scene

SIZE = 128
HALF = (1.2, 1.2, 1.1)  # Of the room, in metres; the origin is its middle.
RECESS = 0.16  # Half the width of the hole in the ceiling, and its depth.
CAMERA = (-1.1, -1.1, 0.1)
LARGER = 300.0
PASSES = 16
MOUNTINGS = ("pendant", "wall", "recessed")
MODES = ("accurate", "fast", "path")
RINGS = (0.5, 0.7, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0, 3.0)  # In radii of the bounding sphere.
Figures = dict[str, Any]


@dataclass(frozen=True)
class Mounting:
    """Where the lamp's bounding sphere is: its centre, and the point the camera looks at."""

    centre: Point
    target: Point


def mountings(radius: float) -> dict[str, Mounting]:
    """Free, with a wall through its sphere, and half in the recess."""
    x, _, z = HALF
    return {
        "pendant": Mounting((0.0, 0.0, 0.4), (0.4, 0.4, -0.3)),
        "wall": Mounting((x - 0.8 * radius, 0.2, 0.1), (0.9, 0.1, 0)),
        "recessed": Mounting((0.0, 0.0, z + 0.2 * radius), (0.3, 0.3, 0.5)),
    }


def write_room(
    folder: Path, name: str, lamp: LampChoice, at: Point, target: Point, reflectance: float = 1.0
) -> Path:
    """The room with the lamp's frame at a point, its surfaces dimmed by a factor; its XML.

    The lamp is brought to the origin, and all is enlarged: Mitsuba lifts rays off surfaces by
    9e-5 (1 + |coordinate|), which a metre away from the origin is a tenth of a millimetre, and gave
    a lamp with thin wires 1.6 % too much light. Radiance does not change.
    """
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    eye, aim = (_enlarged(point, at) for point in (CAMERA, target))
    scene.append(sensor(Picture(SIZE, SIZE), eye, aim, 70))
    things = [*write_parts(folder, "closed", _parts(reflectance)), *lamp.elements(folder, at)]
    for thing in things:
        move(thing, (-at[0], -at[1], -at[2]), LARGER)
    scene.extend(things)
    return write_xml(folder / f"{name}.xml", scene)


def _enlarged(point: Point, origin: Point) -> Point:
    x, y, z = (LARGER * (a - b) for a, b in zip(point, origin, strict=True))
    return x, y, z


def _parts(reflectance: float) -> list[Part]:
    x, y, z = HALF
    side, deep = RECESS, z + 2 * RECESS
    beam = (x - side) / 2
    ceiling = [
        wall((side + beam, 0, z), -3, (beam, y)), wall((-side - beam, 0, z), -3, (beam, y)),
        wall((0, side + beam, z), -3, (side, beam)), wall((0, -side - beam, z), -3, (side, beam)),
        wall((0, 0, deep), -3, (side, side)),
        wall((side, 0, z + side), -1, (side, side)), wall((-side, 0, z + side), 1, (side, side)),
        wall((0, side, z + side), -2, (side, side)), wall((0, -side, z + side), 2, (side, side)),
    ]  # fmt: skip
    walls = [
        wall((x, 0, 0), -1, (y, z)), wall((-x, 0, 0), 1, (y, z)),
        wall((0, y, 0), -2, (z, x)), wall((0, -y, 0), 2, (z, x)),
    ]  # fmt: skip
    furniture = [((0.4, 0.5, -0.85), (0.5, 0.4, 0.5)), ((0.95, -0.4, -0.7), (0.3, 0.3, 0.8))]
    meshes = {
        "ceiling": (trimesh.util.concatenate(ceiling), (0.75, 0.75, 0.75)),
        "walls": (trimesh.util.concatenate(walls), (0.6, 0.5, 0.4)),
        "floor": (wall((0, 0, -z), 3, (x, y)), (0.3, 0.25, 0.2)),
        "boxes": (boxes(furniture), (0.3, 0.4, 0.55)),
    }
    return [
        matt(name, mesh, (reflectance * r, reflectance * g, reflectance * b))
        for name, (mesh, (r, g, b)) in meshes.items()
    ]


# Measuring


@dataclass(frozen=True)
class Room:
    """One mounting of one lamp.

    Arguments:
        sphere: The lamp's bounding sphere in its own frame.
        reflectance: Factor on that of the room's surfaces.
    """

    name: str
    mounting: Mounting
    sphere: BoundingSphere
    folder: Path
    reflectance: float = 1.0

    @property
    def at(self) -> Point:
        """Where the origin of the lamp's frame is."""
        x, y, z = np.subtract(self.mounting.centre, self.sphere.center).tolist()
        return x, y, z

    def picture(self, label: str, lamp: LampChoice, spp: int) -> tuple[Any, float]:
        """A rendering with its halves, and seconds without compilation."""
        import mitsuba as mi

        from purelight_train.truth.picture import Passes

        name = f"{self.name}-{label}"
        path = write_room(self.folder, name, lamp, self.at, self.mounting.target, self.reflectance)
        scene, passes, samples = load_scene(path), Passes(), max(spp // PASSES, 1)
        mi.render(scene, spp=samples)
        start = time.perf_counter()
        for index in range(PASSES):
            image = mi.render(scene, spp=samples, seed=index + 1)
            passes.add(np.array(image, np.float64)[..., :3])
        return passes.picture(), time.perf_counter() - start

    def geometry(self) -> tuple[np.ndarray, np.ndarray]:
        """Pixels that do not see the bounding sphere, and how far their points are from it."""
        import mitsuba as mi

        empty = RealLamp(write_xml(self.folder / "empty.xml", ET.Element("scene")))
        path = write_room(self.folder, "geometry", empty, self.at, self.mounting.target)
        scene = load_scene(path)
        grid = (np.stack(np.meshgrid(*2 * [np.arange(SIZE)]), -1).reshape(-1, 2) + 0.5) / SIZE
        point = mi.Point2f(np.ascontiguousarray(grid.T, np.float32))
        ray, _ = scene.sensors()[0].sample_ray(0, 0.5, point, 0.5)
        met = np.array(scene.ray_intersect(ray).p, np.float64).T.reshape(SIZE, SIZE, 3)
        origin, direction = (np.array(v, np.float64).T for v in (ray.o, ray.d))
        centre = np.array(_enlarged(self.mounting.centre, self.at))
        toward, radius = centre - origin, LARGER * self.sphere.radius
        along = (toward * direction).sum(1)
        off = np.linalg.norm(toward - along[:, None] * direction, axis=1).reshape(SIZE, SIZE)
        distance = np.linalg.norm(met - centre, axis=-1) / radius
        return off > 1.1 * radius, distance

    def measure(self, bundle: Path, real: Path, paths: int, spp: int, path_spp: int) -> Figures:
        """Errors of both modes, and their ratio to the truth ring by ring around the sphere."""
        from purelight_format.srgb import png
        from purelight_train.truth.metrics import Comparison

        spp_truth = -(-paths // SIZE**2)
        truth, seconds = self.picture("truth", RealLamp(real, "ptracer"), spp_truth)
        mask, distance = self.geometry()
        figures: Figures = {"truth": {"seconds": seconds}}
        columns = [truth.image]
        lamps: dict[str, tuple[LampChoice, int]] = {
            mode: (NeuralLamp(bundle.resolve(), mode), spp) for mode in ("accurate", "fast")
        }
        if path_spp:
            lamps["path"] = (RealLamp(real), path_spp)
        for mode, (lamp, samples) in lamps.items():
            picture, seconds = self.picture(mode, lamp, samples)
            columns.append(picture.image)
            figures[mode] = {
                "seconds": seconds,
                **Comparison(picture, truth, mask).to_dict(),
                "p99.99_over_mean": _fireflies(picture.image, truth.image, mask),
                "rings": _rings(picture.image, truth.image, mask, distance),
            }
        if path_spp:
            spent = {k: figures[k]["seconds"] * figures[k]["relative_mse"] for k in lamps}
            for mode in ("accurate", "fast"):
                figures[mode]["path_tracing_takes"] = spent["path"] / spent[mode]
        sheet = np.concatenate([np.where(mask[..., None], c, 0) for c in columns], 1)
        atomic.write_bytes(self.folder / f"{self.name}.png", png(sheet))
        return figures


def _fireflies(image: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> float:
    """99.99th percentile over mean, in units of the truth's."""
    told, true = (
        np.quantile(picture[mask].mean(-1), 0.9999) / picture[mask].mean()
        for picture in (image, truth)
    )
    return float(told / true)


def _rings(
    image: np.ndarray, truth: np.ndarray, mask: np.ndarray, distance: np.ndarray
) -> list[float | None]:
    """Light over true light between the distances of `RINGS`, or none where there is no pixel."""
    result: list[float | None] = []
    for near, far in itertools.pairwise(RINGS):
        ring = mask & (distance >= near) & (distance < far)
        result.append(float(image[ring].sum() / truth[ring].sum()) if ring.sum() > 3 else None)
    return result


def table(results: dict[str, Figures]) -> str:
    """The figures as Markdown."""
    lines = [
        "| lamp | mode | mean | MAPE | (of the reference) | without noise | relMSE | HDR-FLIP "
        "| fireflies | s | path tracing takes |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, figures in results.items():
        for mode in MODES:
            if mode not in figures:
                continue
            row = figures[mode]
            times = row.get("path_tracing_takes")
            lines.append(
                f"| {name} | {mode} | {100 * row['mean']:+.1f} % | {row['mape']:.3f} "
                f"| {row['mape_of_reference']:.3f} | {row['mape_without_noise']:.3f} "
                f"| {row['relative_mse']:.4f} | {row['hdr_flip']:.3f} "
                f"| {row['p99.99_over_mean']:.1f} | {row['seconds']:.0f} "
                f"| {'-' if times is None else f'{times:.0f} times as long'} |"
            )
    lines += ["", f"Over the truth, at {RINGS} radii from the bounding sphere's centre:"]
    for name, figures in results.items():
        for mode in MODES[:2]:
            values = [" - " if v is None else f"{v:.3f}" for v in figures[mode]["rings"]]
            lines.append(f"  {name:9} {mode:9} {'  '.join(values)}")
    return "\n".join(lines)


def main() -> int:
    """Measure every mounting, print the table and write OUTPUT/closed_room.json."""
    parser = command.Parser(prog="python -m benchmarks.closed_room", description=__doc__)
    add = parser.add_argument
    add("--bundle", type=Path, required=True, help=".plux of the lamp")
    add("--lamp", type=Path, required=True, help="the lamp's own scene, .xml")
    add("--mountings", nargs="+", default=MOUNTINGS, choices=MOUNTINGS)
    add("--output", type=Path, default=Path("out/bench"))
    add("--variant", choices=("llvm_ad_rgb", "cuda_ad_rgb"), default="llvm_ad_rgb")
    add("--paths", type=command.whole(1), default=16 << 20, help="of the reference")
    add("--spp", type=command.whole(1), default=256, help="of the neural lamp")
    add("--reflectance", type=command.number(0), default=1, help="factor on all surfaces'")
    add("--path-spp", type=command.whole(0), default=0, help="of the real lamp, path traced")
    arguments = parser.parse_args()
    from purelight_mitsuba import use

    use(arguments.variant)
    sphere = Bundle.open(arguments.bundle).manifest.bounding_sphere
    folder = arguments.output / "closed_room"
    folder.mkdir(parents=True, exist_ok=True)
    results = {}
    for name in arguments.mountings:
        mounting = mountings(sphere.radius)[name]
        print(f"{name} ...", file=sys.stderr, flush=True)
        room = Room(name, mounting, sphere, folder, arguments.reflectance)
        results[name] = room.measure(
            arguments.bundle,
            arguments.lamp,
            arguments.paths,
            arguments.spp,
            arguments.path_spp,
        )
    text = json.dumps(results, indent=2) + "\n"
    atomic.write_bytes(arguments.output / "closed_room.json", text.encode())
    print(table(results))
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.closed_room", main))
