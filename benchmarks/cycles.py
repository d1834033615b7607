"""A lamp in Blender's Cycles beside the Mitsuba runtime, light-traced truth and plain emission.

    python -m benchmarks.cycles --bundle lamp.plux [--lamp lamp.xml] [--spp 64] [--size 64]

Three scenes: a floor four radii below the lamp, with direct light alone; the closed matt room of
the zoo with three bounces, of which pixels that see the lamp are left out; and the lamp itself in
the dark. `plain` is the same mesh with an even emission of the same flux, Cycles' own. Seconds are
those of the processor, on one thread, with all that a renderer does before the first sample; the
Mitsuba runtime's are of a second rendering, its kernels kept. Noise is that of a pixel, relative to
the mean; `at equal time`, times the root of the seconds. With --lamp the floor is light traced.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.finishes import CAMERA, FIELD
from benchmarks.past_lamp import past_lamp
from purelight_blender import packing
from purelight_format import command
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_mitsuba.platform import use
from tests.support import osl_picture
from tests.support.blender_host import Blender

ALBEDO, GREY, BLOCK = 0.5, 0.6, 0.4
BOUNCES = 3
FLOOR, SIDE = 4.0, 8.0  # Below the lamp's centre, and edge, in radii.
Image = NDArray[np.float64]
Renderer = Callable[[int], tuple[Image, float]]  # A seed; picture and seconds.


def main() -> int:
    """Prints a table for each scene."""
    parser = command.Parser(prog="python -m benchmarks.cycles", description=__doc__)
    parser.add_argument("--bundle", type=Path, required=True)
    parser.add_argument("--lamp", type=Path, help="the real lamp, for the truth")
    parser.add_argument("--spp", type=command.whole(1), default=64)
    parser.add_argument("--size", type=command.whole(1), default=64)
    parser.add_argument("--paths", type=command.whole(1), default=1 << 24, help="of the truth")
    options = parser.parse_args()
    program = osl_picture.python()
    if program is None:
        raise PureLightError(f"no Python with bpy; name one in {osl_picture.VARIABLE}")
    use()
    with tempfile.TemporaryDirectory() as folder:
        _compare(options, installed(program, Path(folder)))
    return 0


def installed(program: str, folder: Path) -> Blender:
    """A Blender with the extension."""
    archive, blender = folder / "purelight.zip", Blender(program, folder)
    archive.write_bytes(packing.extension())
    blender.run(("install", {"path": str(archive)}), installed=False)
    return blender


def _compare(options: argparse.Namespace, blender: Blender) -> None:
    bundle = Bundle.open(options.bundle)
    truth = _truth(bundle, options) if options.lamp else None
    for scene in (kind(bundle, options.size) for kind in (Floor, Room, View)):
        print(f"\n{scene.title}, {options.spp} samples\n")
        for line in table(scene, bundle, blender, options.spp, truth):
            print(line, flush=True)
        truth = None


def table(
    scene: Floor | Room | View, bundle: Bundle, blender: Blender, spp: int, truth: Image | None
) -> Iterator[str]:
    """A line for each renderer; errors are over the truth, or else over the Mitsuba runtime."""
    beside = "Mitsuba" if truth is None else "truth"
    yield f"| renderer | mean | over {beside} | error by pixel | seconds | noise | at equal time |"
    yield "|---|---|---|---|---|---|---|"
    for name, render in renderers(scene, bundle, blender, spp).items():
        (one, _), (two, seconds) = render(1), render(2)
        both = (one + two) / 2
        truth = both if truth is None else truth
        seen = scene.seen
        level = both[seen].mean()
        noise = float(np.sqrt(((one - two)[seen] ** 2).mean() / 2) / level)
        ratio = level / truth[seen].mean() - 1
        error = np.abs(both - truth)[seen].mean() / truth[seen].mean()
        compared = f"{100 * ratio:+.2f} % | {100 * error:.1f} %"
        compared = "- | -" if name.endswith("plain") else compared
        yield (
            f"| {name} | {level:.4g} | {compared} | {seconds:.1f} | {noise:.3f} | "
            f"{noise * seconds**0.5:.2f} |"
        )


def renderers(
    scene: Floor | Room | View, bundle: Bundle, blender: Blender, spp: int
) -> dict[str, Renderer]:
    """What is compared, by name."""
    strength = float(bundle.manifest.radiance_scale)

    def cycles(*before: tuple[str, dict[str, Any]]) -> Renderer:
        def render(seed: int) -> tuple[Image, float]:
            path = blender.folder / "picture.exr"
            shot = {"path": str(path), "samples": spp, "seed": seed, **scene.shot}
            asked = [
                ("empty", {}), ("plux", {"path": str(bundle.path.resolve()), "at_cursor": False}),
                *before, *scene.steps, ("picture", shot),
            ]  # fmt: skip
            seconds = blender.run(*asked)[-1]
            return pixels(path) * scene.factor, seconds

        return render

    def mitsuba(mode: str) -> Renderer:
        import mitsuba as mi

        import purelight_mitsuba

        purelight_mitsuba.register()
        lamp = {"type": "purelight", "filename": str(bundle.path.resolve())}
        depth = scene.shot["bounces"] + 2
        integrator = {"type": "purelight", "mode": mode, "max_depth": depth}
        made = mi.load_dict(
            {"type": "scene", "integrator": integrator, "lamp": lamp, **scene.objects()}
        )
        np.array(mi.render(made, spp=spp, seed=99))

        def render(seed: int) -> tuple[Image, float]:
            start = time.process_time()
            image = np.array(mi.render(made, spp=spp, seed=seed), np.float64)[..., :3]
            return image * scene.factor, time.process_time() - start

        return render

    made = {}
    if {"sampler", "sampler_pdf"} <= bundle.manifest.networks.keys():
        made["Mitsuba runtime, accurate"] = mitsuba("accurate")
    if "fast_map" in bundle.manifest.networks:
        made["Mitsuba runtime, fast"] = mitsuba("fast")
    plain = ("plain", {"strength": strength})
    return made | {"Cycles, OSL": cycles(), "Cycles, plain": cycles(plain)}


class Floor:
    """Irradiance on a floor below the lamp, from above.

    Arguments:
        bundle: of the lamp.
        size: pixels of an edge.
    """

    title = "Irradiance of a floor four radii below, direct light"
    factor = np.pi / ALBEDO

    def __init__(self, bundle: Bundle, size: int) -> None:
        from purelight_train.truth.plane import Plane

        sphere = bundle.manifest.bounding_sphere
        x, y, z = map(float, sphere.center)
        self.edge, self.height = SIDE * sphere.radius, z - FLOOR * sphere.radius
        self.plane = Plane((x, y, self.height), self.edge, size)
        self.seen = np.ones((size, size), bool)
        self.eye = np.eye(4)
        self.eye[:3, 3] = x, y, self.height + 0.5 * sphere.radius
        self.shot: dict[str, Any] = {
            "camera": self.eye.tolist(), "size": self.edge, "pixels": size, "bounces": 0,
        }  # fmt: skip
        self.steps = [("floor", {"z": self.height, "size": 40 * sphere.radius})]

    def objects(self) -> dict[str, Any]:
        """The same in Mitsuba."""
        import mitsuba as mi

        from benchmarks.zoo.figures.scenes import film

        T, size = mi.ScalarTransform4f, self.plane.cells
        half = self.edge / 2
        at = self.eye[:3, 3]
        look = T().look_at(list(at), list(at - [0, 0, 1]), [0, 1, 0]).scale([half, half, 1])
        place = T().translate([at[0], at[1], self.height]).scale(10 * half)
        grey = {"type": "rgb", "value": ALBEDO}
        return {
            "sensor": {
                "type": "orthographic", "to_world": look, "film": film(size, size),
                "near_clip": 1e-3 * half, "far_clip": 1e2 * half,
            },
            "floor": {
                "type": "rectangle", "to_world": place,
                "bsdf": {"type": "diffuse", "reflectance": grey},
            },
        }  # fmt: skip


class Room:
    """The closed matt room of the zoo.

    Arguments:
        bundle: of the lamp.
        size: pixels of an edge.
    """

    title = f"A closed room, {BOUNCES} bounces"
    factor = 1.0

    def __init__(self, bundle: Bundle, size: int) -> None:
        import mitsuba as mi

        from benchmarks.zoo.figures import scenes

        sphere = bundle.manifest.bounding_sphere
        self.sphere, self.size = sphere, size
        made = scenes.room(sphere, size)
        self.seen = past_lamp(mi.load_dict(made["sensor"]), sphere)
        self.shot = _shot(made["sensor"], size, BOUNCES)
        self.steps = [
            ("box", {"world": _matrix(made[name]["to_world"]).tolist(), "reflectance": grey})
            for name, grey in (("walls", GREY), ("block", BLOCK))
        ]

    def objects(self) -> dict[str, Any]:
        """The same in Mitsuba."""
        from benchmarks.zoo.figures import scenes

        return scenes.room(self.sphere, self.size)


class View:
    """The lamp, seen from beside and above.

    Arguments:
        bundle: of the lamp.
        size: pixels of an edge.
    """

    title = "The lamp seen directly"
    factor = 1.0
    steps: ClassVar[list[tuple[str, dict[str, Any]]]] = []

    def __init__(self, bundle: Bundle, size: int) -> None:
        import mitsuba as mi

        from benchmarks.zoo.figures.scenes import film

        sphere = bundle.manifest.bounding_sphere
        at = list(map(float, sphere.center))
        eye = [c + sphere.radius * d for c, d in zip(at, CAMERA, strict=True)]
        look = mi.ScalarTransform4f().look_at(eye, at, [0, 0, 1])
        self.sensor = {
            "type": "perspective", "fov": FIELD, "to_world": look, "film": film(size, size),
            "near_clip": 1e-2 * sphere.radius, "far_clip": 1e2 * sphere.radius,
        }  # fmt: skip
        self.seen = ~past_lamp(mi.load_dict(self.sensor), sphere)
        self.shot = _shot(self.sensor, size, 0)

    def objects(self) -> dict[str, Any]:
        """The same in Mitsuba."""
        return {"sensor": self.sensor}


def _shot(sensor: dict[str, Any], size: int, bounces: int) -> dict[str, Any]:
    """What Blender is told of a camera of Mitsuba's."""
    turned = np.diag([-1.0, 1, -1, 1])  # Mitsuba's cameras look along +Z, with X to the left.
    eye = _matrix(sensor["to_world"]) @ turned
    return {
        "camera": eye.tolist(), "size": 1.0, "fov": sensor["fov"], "pixels": size,
        "bounces": bounces,
    }  # fmt: skip


def _matrix(transform: Any) -> Image:
    return np.array(transform.matrix, np.float64).reshape(4, 4)


def _truth(bundle: Bundle, options: argparse.Namespace) -> Image:
    """The floor's irradiance by tracing light from the real lamp, rows from the top."""
    from purelight_train.light.luminaire import load_luminaire
    from tests.support.fidelity import traced_plane

    lamp = load_luminaire(options.lamp)
    mean, error = traced_plane(lamp.scene, Floor(bundle, options.size).plane, options.paths, 5)
    print(f"truth: {options.paths:,} paths, noise of a cell {error.mean() / mean.mean():.3f}")
    return mean[::-1]


def pixels(path: Path) -> Image:
    """A picture of Blender's: [height, width, 3]."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        channels = [channel.pixels for channel in file.channels().values()]
    return np.asarray(channels[0][..., :3], np.float64)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.cycles", main))
