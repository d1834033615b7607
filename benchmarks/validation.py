"""Time and memory of the validator: python -m benchmarks.validation [--megabytes 350].

Every figure is measured in a process of its own, seconds are the processor's. The bars are those
of the project: container, manifest and USD checks of 350 MB in 3 s and 64 MiB above the file; no
bad bundle takes 2 s or 512 MiB. Full vetting is reported.
"""

from __future__ import annotations

import os
import pickle
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import onnx
import trimesh
from onnx import TensorProto, helper, numpy_helper

from purelight_format import bundle, command
from purelight_format.members.surface import Surface
from purelight_format.validation.validate import examine_file, validate
from tests.assets import golden_reports
from tests.support import bundles, lamp

SHARES = {"appearance": 0.5, "transparency": 0.25, "sampler": 0.125, "sampler_pdf": 0.125}
ENTRY = 8  # Numbers of a table's row.
SUBDIVISIONS = 6  # 81,920 triangles
MIB = 1 << 20


class Figure(NamedTuple):
    """What a process took: seconds of a processor, and MiB at its peak and before it began."""

    seconds: float
    peak: float
    before: float


def measure(action: Callable[[], Any]) -> Figure:
    """Runs an action in a process of its own, which has what this one has loaded."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        before, start = _resident(), time.process_time()
        action()
        os.write(writer, pickle.dumps((time.process_time() - start, before)))
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        data = pipe.read()
    _, status, usage = os.wait4(child, 0)
    if status:
        sys.exit(f"error: a measured process ended with {os.waitstatus_to_exitcode(status)}")
    seconds, before = pickle.loads(data)
    return Figure(seconds, usage.ru_maxrss / 1024, before)


def _resident() -> float:
    """MiB that this process has in memory now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / MIB


# A large bundle


def write_large(path: Path, megabytes: float) -> None:
    """A valid bundle whose networks are tables of that size in all."""
    large = {}
    for name, share in SHARES.items():
        data = _with_table(lamp.NETWORKS[name](), int(share * megabytes * 1e6 / (4 * ENTRY)))
        large[name] = data, lamp.golden(name, data)
    manifest, content = bundles.with_networks(lamp.parts(), large)
    bundle.write(path, manifest, content | _fine_surface().to_members())


def _with_table(proto: onnx.ModelProto, rows: int) -> bytes:
    """Adds the lookup of a random table, by an index computed from the first input."""
    node, graph, random = helper.make_node, proto.graph, np.random.default_rng(0)
    lookup = [
        node("Clip", [graph.input[0].name, "low", "high"], ["place"]),
        node("Cast", ["place"], ["index"], to=TensorProto.INT64),
        node("Gather", ["table", "index"], ["entries"]),
    ]
    constants = {"low": np.float32(0), "high": np.float32(rows - 1),
                 "table": random.random((rows, ENTRY), np.float32)}  # fmt: skip
    nodes = [*lookup, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
    graph.initializer.extend(numpy_helper.from_array(np.array(v), k) for k, v in constants.items())
    return proto.SerializeToString()


def _fine_surface() -> Surface:
    """A sphere of many triangles, whose mesh is most of the USD layer."""
    sphere = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    positions = 0.99 * lamp.SPHERE.radius * sphere.vertices + lamp.SPHERE.center
    flux = np.tile(np.array(lamp.FLUX) / len(sphere.faces), (len(sphere.faces), 1))
    return Surface(
        positions.astype(np.float32), sphere.faces.astype(np.uint32), flux.astype(np.float32)
    )


def report_large(folder: Path, megabytes: float) -> bool:
    """Prints the figures of a large bundle; returns whether they are below the bars."""
    path = folder / "large.plux"
    measure(lambda: write_large(path, megabytes))
    size = path.stat().st_size / MIB
    measure(path.read_bytes)  # The file is in the page cache from here on.
    quick = measure(lambda: require(examine_file(path, depth=1).report.valid))
    full = measure(lambda: require(validate(path).valid))
    for name, figure in (("container, manifest, digests, USD", quick), ("full vetting", full)):
        above = figure.peak - figure.before - size
        print(f"{name:<36}{figure.seconds:6.2f} s{above:8.0f} MiB above the file of {size:.0f} MiB")
    return quick.seconds < 3 and quick.peak - quick.before - size < 64


def require(valid: bool) -> None:
    """Ends the process if the bundle was not what it should be."""
    if not valid:
        os._exit(1)


# Bad bundles


def report_bad(folder: Path) -> bool:
    """Prints the costliest of the bad bundles; returns whether they are below the bars."""
    golden_reports.report_of(None, None, folder)  # Every module is loaded now.
    figures = {name: _bad(name, folder) for name in golden_reports.NAMES}
    for title, key in (("time", 0), ("memory", 1)):
        for name in sorted(figures, key=lambda n: -figures[n][key])[:3]:
            seconds, peak, _ = figures[name]
            print(f"most {title:<8}{name:<40}{seconds:6.2f} s{peak:8.0f} MiB in all")
    print(f"{len(figures)} bad bundles")
    return all(figure.seconds < 2 and figure.peak < 512 for figure in figures.values())


def _bad(name: str, folder: Path) -> Figure:
    path = folder / "lamp.plux"
    for old in folder.glob("lamp.*"):
        old.unlink()
    measure(lambda: golden_reports.write(name, folder))
    return measure(lambda: require(bool(validate(path).issues)))


def main() -> int:
    """0 if every figure is below its bar, 1 otherwise."""
    parser = command.Parser(prog="python -m benchmarks.validation", description=__doc__)
    parser.add_argument("--megabytes", type=command.number(0), default=350)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        below = [report_bad(Path(folder)), report_large(Path(folder), options.megabytes)]
    print("all below the bars" if all(below) else "ABOVE A BAR")
    return 0 if all(below) else 1


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.validation", main))
