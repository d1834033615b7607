"""Noise and time of choosing lamps by what they give at a point, beside choosing them by power.

python -m benchmarks.lamp_choice --lamp lamp.plux [--counts 1 30 60] [--passes 8] [--mode accurate]
    [--engine auto]

Copies of a lamp, a tenth of a metre in radius, hang every two metres under the ceiling of a
corridor. For each number of them it prints both ways' seconds a rendering, their variance over the
squared mean (the median of the pixels), and how much longer by power takes to equal noise.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format import command

APART, WIDTH, HEIGHT, RADIUS, SIZE = 2.0, 2.0, 2.5, 0.1, 96  # Metres; pixels.


def main() -> int:
    """Prints a row per number of lamps."""
    parser = command.Parser(prog="python -m benchmarks.lamp_choice", description=__doc__)
    add = parser.add_argument
    add("--lamp", type=Path, required=True, help=".plux bundle")
    add("--counts", type=command.whole(1), nargs="+", default=(1, 30, 60), help="of lamps")
    add("--passes", type=command.whole(2), default=8, help="renderings each")
    add("--spp", type=command.whole(1), default=16)
    add("--mode", default="accurate")
    add("--engine", default="auto")
    arguments = parser.parse_args()
    from purelight_mitsuba import use

    use()
    print("lamps   s here  s power   var here  var power    gain")
    for count in arguments.counts:
        _row(arguments, count)
    return 0


def _row(arguments: argparse.Namespace, count: int) -> None:
    from purelight_mitsuba.lamps import table

    ours, by_power = table.LampChoice, _by_power()
    figures = []
    for choice in (ours, by_power):
        table.LampChoice = choice  # type: ignore[misc]
        figures.append(_measure(arguments, count))
    table.LampChoice = ours  # type: ignore[misc]
    (seconds, noise), (seconds_power, noise_power) = figures
    gain = seconds_power * noise_power / (seconds * noise)
    row = f"{seconds:8.3f} {seconds_power:8.3f} {noise:10.4f} {noise_power:10.4f} {gain:7.2f}"
    print(f"{count:5} {row}", flush=True)


def _by_power() -> Any:
    """A class that chooses lamps by their power, wherever they are."""
    import drjit as dr
    import mitsuba as mi

    from purelight_mitsuba.lamps.lamp_choice import LampChoice, Scales

    class ByPower(LampChoice):
        def _scales(self, p: mi.Point3f, active: mi.Bool, own: mi.UInt32) -> Scales:
            del p, active
            return Scales(dr.zeros(mi.Float), self._without_own(own))

    return ByPower


def _measure(arguments: argparse.Namespace, count: int) -> tuple[float, float]:
    """Median seconds, and median relative variance of the pixels."""
    import mitsuba as mi

    scene = mi.load_dict(corridor(arguments.lamp, count))
    settings = {"type": "purelight", "mode": arguments.mode, "engine": arguments.engine}
    integrator = mi.load_dict(settings | {"max_depth": 3})
    images, seconds = [], []
    for seed in range(arguments.passes + 1):
        start = time.perf_counter()
        image = mi.render(scene, integrator=integrator, spp=arguments.spp, seed=seed)
        images.append(np.array(image)[..., :3].mean(-1))
        seconds.append(time.perf_counter() - start)
    mean, variance = np.mean(images[1:], 0), np.var(images[1:], 0, ddof=1)  # The first compiles.
    lit = mean > 0
    return float(np.median(seconds[1:])), float(np.median(variance[lit] / mean[lit] ** 2))


def corridor(path: Path, count: int) -> dict[str, Any]:
    """A corridor, seen along its length, with one lamp in the middle or more all along."""
    import mitsuba as mi

    from purelight_mitsuba.lamps.luminaire import load

    transform, sphere = mi.ScalarTransform4f, load(path).sphere
    length = APART * max(count, 30)
    content: dict[str, Any] = {"type": "scene"}
    content["sensor"] = {
        "type": "perspective",
        "fov": 60,
        "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE},
        "to_world": transform().look_at([0, -length / 4, 1.6], [0, 0, 1.4], [0, 0, 1]),
    }
    walls = {
        "floor": ([0, 0, 0], [1, 0, 0], 0), "ceiling": ([0, 0, HEIGHT], [1, 0, 0], 180),
        "left": ([-WIDTH / 2, 0, HEIGHT / 2], [0, 1, 0], 90),
        "right": ([WIDTH / 2, 0, HEIGHT / 2], [0, 1, 0], -90),
    }  # fmt: skip
    for name, (centre, axis, angle) in walls.items():
        turned = transform().translate(centre).rotate(axis, angle)
        content[name] = {"type": "rectangle", "to_world": turned.scale([HEIGHT, length / 2, 1])}
    for index in range(count):
        there = [0, APART * (index - (count - 1) / 2), HEIGHT - 2 * RADIUS]
        hung = transform().translate(there).scale(RADIUS / sphere.radius)
        to_world = hung.translate([-c for c in sphere.center])
        content[f"lamp{index}"] = {
            "type": "purelight", "filename": str(path.resolve()), "to_world": to_world,
        }  # fmt: skip
    return content


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.lamp_choice", main))
