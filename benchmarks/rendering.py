"""What a lamp costs in a room, beside the same room with a plain spherical area light.

python -m benchmarks.rendering --output out/bench --lamp lamp.plux [--size 512 512] [--spp 64]

Every rendering has a process of its own, so that its peak memory is its own. Those that reach
--limit stop there, and their time is extrapolated from the samples they finished; it says so.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format import atomic, command
from purelight_format.bundle import Bundle
from purelight_mitsuba.scene_file import load_scene

PASS_SPP = 8
Figures = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One rendering of the room.

    Arguments:
        name: Row of the table.
        scene: Mitsuba XML.
        engine: Of the integrator `purelight`; empty for Mitsuba's own.
        symbolic: Whether loops stay in one kernel.
        limit: Seconds.
    """

    name: str
    scene: Path
    engine: str
    symbolic: bool
    spp: int
    limit: float


def main() -> int:
    """Measure, print the tables and write OUTPUT/rendering.json."""
    parser = command.Parser(prog="python -m benchmarks.rendering", description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/bench"))
    add("--lamp", type=Path, nargs="+", required=True, help=".plux bundles")
    add("--size", type=command.whole(1), nargs=2, default=(512, 512), metavar=("W", "H"))
    add("--spp", type=command.whole(1), default=64)
    add("--limit", type=command.number(0), default=600, help="seconds of one rendering")
    arguments = parser.parse_args()
    results = measure(arguments)
    report = arguments.output / "rendering.json"
    atomic.write_bytes(report, (json.dumps(results, indent=2) + "\n").encode())
    print(table(results))
    return 0


def measure(arguments: argparse.Namespace) -> Figures:
    """Figures of every rendering and of every network."""
    results: Figures = {"size": list(arguments.size), "spp": arguments.spp, "renderings": {}}
    for job in jobs(arguments):
        print(f"{job.name} ...", file=sys.stderr, flush=True)
        results["renderings"][job.name] = _alone(render, job)
    plain = results["renderings"]["plain sphere"]
    for row in results["renderings"].values():
        for clock in ("seconds", "cpu_seconds"):
            row[f"{clock}_over_plain"] = row[clock] / plain[clock]
    results["networks"] = {str(lamp): _alone(_speed, lamp) for lamp in arguments.lamp}
    return results


def jobs(arguments: argparse.Namespace) -> list[Job]:
    """The room with a plain light, and with each lamp by each engine."""
    from purelight_examples.scenes import room
    from purelight_examples.scenes.lamp_choice import NeuralLamp, SphereLamp

    folder = arguments.output / "room"
    folder.mkdir(parents=True, exist_ok=True)
    picture = room.Picture(arguments.size[0], arguments.size[1], arguments.spp)
    rest = (arguments.spp, arguments.limit)
    flux = Bundle.open(arguments.lamp[0]).manifest.flux
    scene = room.write(folder, SphereLamp(flux), picture, "plain")
    result = [Job("plain sphere", scene, "", True, *rest)]
    for index, lamp in enumerate(arguments.lamp):
        for mode, engine, symbolic in (
            ("accurate", "fused", True), ("accurate", "queued", True), ("fast", "auto", True),
            ("accurate", "fused", False),
        ):  # fmt: skip
            neural = NeuralLamp(lamp.resolve(), mode)
            scene = room.write(folder, neural, picture, f"{mode}-{index}")
            name = f"{lamp.stem} {mode} {engine}" + ("" if symbolic else ", evaluated loops")
            result.append(Job(name, scene, engine, symbolic, *rest))
    return result


def _alone(function: Any, argument: Any) -> Figures:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        result: Figures = pool.apply(function, (argument,))
    return result


def _speed(bundle: Path) -> Figures:
    from purelight_mitsuba import use

    use()
    from benchmarks.network_speed import network_speed

    return network_speed(bundle)


def render(job: Job) -> Figures:
    """Renders in passes of `PASS_SPP` samples, at least two, and judges noise from their halves."""
    from purelight_mitsuba import use

    mi = use()
    import drjit as dr

    for flag in (dr.JitFlag.SymbolicLoops, dr.JitFlag.SymbolicCalls):
        dr.set_flag(flag, job.symbolic)
    scene = load_scene(job.scene)
    if job.engine:
        scene.integrator().engine = job.engine
    start = time.perf_counter()
    _image(mi.render(scene, spp=PASS_SPP, seed=0))
    first = time.perf_counter() - start
    halves, done = [0.0, 0.0], 0
    start, cpu = time.perf_counter(), time.process_time()
    while done < 2 or (PASS_SPP * done < job.spp and time.perf_counter() - start < job.limit):
        halves[done % 2] = halves[done % 2] + _image(mi.render(scene, spp=PASS_SPP, seed=done + 1))
        done += 1
    scale = job.spp / (PASS_SPP * done)
    return {
        "first_pass_seconds": first,
        "seconds": (time.perf_counter() - start) * scale,
        "cpu_seconds": (time.process_time() - cpu) * scale,
        "extrapolated_from_spp": PASS_SPP * done if scale > 1 else None,
        "peak_megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        **_quality(scene, halves, done, scale),
        **{key: str(value) for key, value in asdict(job).items() if key in ("engine", "symbolic")},
    }


def _quality(scene: Any, halves: list[Any], passes: int, scale: float) -> Figures:
    """Noise and fireflies where the camera does not see the lamp itself."""
    a, b = halves[0] / ((passes + 1) // 2), halves[1] / (passes // 2)
    image = (a + b) / 2
    unlit = _image(_direct(scene)).max(-1) == 0
    mean = image[unlit].mean()
    variance = ((a - b) ** 2 / 4 / (image**2 + 0.01 * mean**2))[unlit].mean()
    return {
        "mean": float(mean),
        "relative_variance": float(variance / scale),
        "p99.99_over_mean": float(np.quantile(image[unlit].mean(-1), 0.9999) / mean),
    }


def _direct(scene: Any) -> Any:
    """Only what the camera itself sees shine."""
    import mitsuba as mi

    kind = "purelight" if type(scene.integrator()).__name__.startswith("PureLight") else "path"
    integrator = mi.load_dict({"type": kind, "max_depth": 1})
    return mi.render(scene, integrator=integrator, spp=64, seed=12345)


def _image(rendered: Any) -> Any:
    return np.array(rendered, dtype=np.float64)[..., :3]


def table(results: Figures) -> str:
    """Both tables as text."""
    lines = [
        f"{results['size'][0]} x {results['size'][1]} pixels, {results['spp']} spp",
        f"{'':44}{'s':>8}{'x plain':>9}{'cpu s':>8}{'x plain':>9}{'noise':>9}"
        f"{'fireflies':>10}{'MB':>7}",
    ]
    for name, row in results["renderings"].items():
        spp = row["extrapolated_from_spp"]
        lines.append(
            f"{name:44}{row['seconds']:8.1f}{row['seconds_over_plain']:9.2f}"
            f"{row['cpu_seconds']:8.1f}{row['cpu_seconds_over_plain']:9.2f}"
            f"{row['relative_variance']:9.5f}{row['p99.99_over_mean']:10.1f}"
            f"{row['peak_megabytes']:7.0f}" + (f"  (from {spp} spp)" if spp else "")
        )
    for lamp, figures in results["networks"].items():
        lines.append(f"{lamp}: peak {figures['gemm_flops'] / 1e9:.0f} GFLOP/s")
        for name, engines in figures["networks"].items():
            parts = (
                f"{engine} {v['per_second'] / 1e6:6.2f} M/s ({100 * v['share_of_peak']:3.0f} %)"
                for engine, v in engines.items()
            )
            lines.append(f"  {name:14}" + "   ".join(parts))
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.rendering", main))
