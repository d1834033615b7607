"""From which bounce on Russian roulette is least noisy, for a scene of a stock integrator.

python -m benchmarks.roulette SCENE.xml ... [--depths 8 16 32 64] [--spp 32] [--passes 12]
    [--integrator path]

Scenes are those that `benchmarks.systems` leaves: OUTPUT/SCALE/LAMP/systems/path/TASK/TASK.xml.
In glass a path's throughput and index of refraction are far from one, and roulette that takes them
for its chance leaves few paths that weigh much. Told are, per depth, the picture's mean with its
standard error, its relative variance (mean of the pixels' variance over the squared mean),
processor seconds, and the product of both: the noise at equal time.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format import command
from purelight_format.errors import PureLightError


def main() -> int:
    """Prints a row per scene and depth."""
    parser = command.Parser(prog="python -m benchmarks.roulette", description=__doc__)
    add = parser.add_argument
    add("scenes", type=Path, nargs="+", metavar="SCENE")
    add("--integrator", choices=("path", "volpath", "ptracer"), default="path")
    add("--depths", type=command.whole(1), nargs="+", default=(8, 16, 32, 64), metavar="N")
    add("--spp", type=command.whole(1), default=32, help="samples a pixel of each pass")
    add("--passes", type=command.whole(2), default=12)
    arguments = parser.parse_args()
    print(f"{'scene':40} depth       mean    error   variance  seconds  variance x seconds")
    for scene in arguments.scenes:
        _rows(scene, arguments)
    return 0


def _rows(path: Path, arguments: argparse.Namespace) -> None:
    from purelight_mitsuba import use
    from purelight_mitsuba.scene_file import load_scene

    use()
    scene = load_scene(path)
    if not scene.sensors():
        raise PureLightError(f"{path}: no sensor that it could be drawn with")
    name = " ".join((*path.parts[-5:-4], path.stem))
    for depth in arguments.depths:
        passes, seconds = _passes(scene, depth, arguments)
        told = passes.mean((1, 2, 3))
        mean, error = told.mean(), told.std(ddof=1) / len(told) ** 0.5
        if not mean:
            print(f"{name:40} {depth:5} dark: no path found light; raise --spp", flush=True)
            continue
        variance = passes.var(0, ddof=1).mean() / len(passes) / mean**2
        row = f"{mean:10.4g} {error / mean:8.2%} {variance:10.3g} {seconds:8.2f}"
        print(f"{name:40} {depth:5} {row} {variance * seconds:19.4g}", flush=True)


def _passes(
    scene: Any, depth: int, arguments: argparse.Namespace
) -> tuple[NDArray[np.float64], float]:
    """Pictures [passes, rows, columns, 3], and their processor seconds; one before is not timed."""
    import mitsuba as mi

    integrator = mi.load_dict({"type": arguments.integrator, "max_depth": -1, "rr_depth": depth})

    def render(seed: int) -> NDArray[np.float64]:
        picture = mi.render(scene, integrator=integrator, spp=arguments.spp, seed=seed)
        return np.array(picture)[..., :3].astype(np.float64)

    render(arguments.passes)
    begun = time.process_time()
    passes = np.stack([render(seed) for seed in range(arguments.passes)])
    return passes, time.process_time() - begun


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.roulette", main))
