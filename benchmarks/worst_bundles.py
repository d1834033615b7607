"""The worst valid bundles of a megabyte: seconds and memory of every command that opens one.

python -m benchmarks.worst_bundles [--only sines nodes] [--limit 300]

Each bundle is valid and near one limit of the format, in its appearance and its transparency. The
bars are 10 s and 512 MiB to validate, and 60 s to a first picture: of `purelight-view` as it is
called without options, and of `purelight-render` of a small room, one sample a pixel.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.one_network import INT64, Body, Graph, layers, repeated
from benchmarks.validation import measure
from purelight_format import bundle, command
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import Vectors
from tests.support import bundles, lamp

VALIDATE, PICTURE, MEMORY = 10.0, 60.0, 512
NETWORKS = ("appearance", "transparency")

ROOM = """<scene version="3.0.0"><integrator type="purelight"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="128"/>
<integer name="height" value="128"/></film><transform name="to_world">
<lookat origin="{far}, 0, {far}" target="0, 0, 0" up="0, 0, 1"/></transform></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="{far}"/>
<translate z="-{far}"/></transform></shape>
<emitter type="purelight"><string name="filename" value="{bundle}"/></emitter></scene>"""


# Networks near a limit


def sums(g: Graph) -> tuple[str, int]:
    """Sums of a wide row, each one column of the next."""
    x, one = g.wide(8192), g.constant([1], INT64)
    parts = [g.node("ReduceSum", g.node("Sin", x) if k == 0 else x, one) for k in range(27)]
    return g.node("Concat", *parts, axis=1), 27


def largest(g: Graph) -> tuple[str, int]:
    """The largest of 256 equal operands."""
    x = g.wide(2048)
    return g.node("Max", *[x] * 256), 2048


def remainders(g: Graph) -> tuple[str, int]:
    width = 18_000
    return g.node("Mod", g.wide(width), g.constant(np.full(width, 0.3)), fmod=1), width


def small_nodes(g: Graph) -> tuple[str, int]:
    x, one = "position", g.constant(1.0)
    for _ in range(4000):
        x = g.node("Add", x, one)
    return x, 3


def doubled(g: Graph) -> tuple[str, int]:
    """Operands that repeat: forty times Add(x, x)."""
    x = "position"
    for _ in range(40):
        x = g.node("Add", x, x)
    return x, 3


def operands(g: Graph) -> tuple[str, int]:
    x = g.wide(1)
    return g.node("Concat", *[g.node("Max", *[x] * 250) for _ in range(200)], axis=1), 200


def chosen(width: int) -> Body:
    """Every column chosen among all columns."""

    def body(g: Graph) -> tuple[str, int]:
        x = g.wide(width)
        return g.node("GatherElements", x, g.indices(x, width), axis=1), width

    return body


def wide(g: Graph) -> tuple[str, int]:
    """As many columns as one value may have."""
    x = g.wide(4096)
    return g.node("Concat", *[x] * 16, axis=1), 65_536


BODIES: dict[str, Body] = {
    "sines": repeated("Sin", 3000, 40),
    "few sines": repeated("Sin", 240, 4),
    "softmax": repeated("Softmax", 3000, 30),
    "additions": repeated("Neg", 20_000, 45),
    "sums": sums,
    "largest": largest,
    "remainders": remainders,
    "nodes": small_nodes,
    "doubled": doubled,
    "operands": operands,
    "chosen": chosen(5000),
    "few chosen": chosen(95),
    "wide": wide,
    "layers": layers(256, 244),
    "few layers": layers(256, 24),
}


# Bundles


def write(path: Path, name: str) -> None:
    """The tests' lamp with the networks, or the surface, of a name."""
    worst: dict[str, tuple[bytes, Vectors]] = {}
    if name in BODIES:
        for network in NETWORKS:
            g = Graph()
            data = g.model(*BODIES[name](g), network)
            golden = lamp.golden(network, data, 64)
            loose = {k: 1 + np.abs(y) for k, y in golden.outputs.items()}  # Indices may jump.
            worst[network] = data, replace(golden, tolerances=loose)
    manifest, content = bundles.with_networks(lamp.parts(), worst)
    surface = {} if name in BODIES else SURFACES[name]().to_members()
    bundle.write(path, manifest, content | surface)


def equal_triangles() -> Surface:
    """Triangles that fill the sphere, one on the other."""
    corners = lamp.SPHERE.radius * np.array([[0, 0, 0.99], [0.9, 0, -0.4], [-0.5, 0.7, -0.4]])
    return _surface(corners, np.tile([0, 1, 2], (3_100, 1)))


def slivers() -> Surface:
    """Long triangles without area that cross in the middle."""
    count = 4_800
    way = np.random.default_rng(0).normal(size=(count, 3))
    way *= 0.99 * lamp.SPHERE.radius / np.linalg.norm(way, axis=1, keepdims=True)
    side = way * (1 - 1e-6)
    ends = np.stack((way, -way, side), 1).reshape(-1, 3)
    return _surface(ends, np.arange(3 * count).reshape(-1, 3))


def _surface(positions: np.ndarray, triangles: np.ndarray) -> Surface:
    flux = np.tile(np.array(lamp.FLUX) / len(triangles), (len(triangles), 1))
    places = positions + np.array(lamp.SPHERE.center)
    return Surface(places.astype(np.float32), triangles.astype(np.uint32), flux.astype(np.float32))


SURFACES: dict[str, Callable[[], Surface]] = {
    "equal triangles": equal_triangles,
    "slivers": slivers,
}


# Commands


def commands() -> dict[str, list[str]]:
    """What a user would call, in the folder of the bundle."""
    validate, view, draw = (
        installed(f"purelight-{name}") for name in ("validate", "view", "render")
    )
    render = [draw, "scene.xml", "--spp", "1", "--output", "a.exr", "--mode"]
    return {
        "validate": [validate, "lamp.plux"],
        "view": [view, "lamp.plux", "--output", "v.exr"],
        "accurate": [*render, "accurate"],
        "fast": [*render, "fast"],
    }


def installed(name: str) -> str:
    """A command of the environment that runs this, which need not be on the PATH."""
    return str(Path(sysconfig.get_path("scripts")) / name)


def called(words: list[str], folder: Path, limit: float) -> tuple[float, float, int, str]:
    """Seconds, MiB, exit code and last line of a command in a process of its own."""
    start, errors = time.perf_counter(), folder / "errors"
    with open(errors, "w") as file:
        home = os.environ | {"HOME": str(folder)}  # In which no kernel is kept from an earlier run.
        process = subprocess.Popen(words, cwd=folder, env=home, stdout=file, stderr=file)
    while True:
        done, status, usage = os.wait4(process.pid, os.WNOHANG)
        if done:
            break
        if time.perf_counter() - start > limit:
            process.kill()
        time.sleep(0.02)
    process.returncode = os.waitstatus_to_exitcode(status)
    text = errors.read_text().replace("\r", "\n").strip().splitlines()
    return (time.perf_counter() - start, usage.ru_maxrss / 1024, process.returncode,
            text[-1] if text else "")  # fmt: skip


def row(name: str, limit: float) -> bool:
    """Prints the figures of a bundle; returns whether they are below the bars."""
    below = True
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        measure(lambda: write(folder / "lamp.plux", name))  # So no command inherits its memory.
        far = 4 * lamp.SPHERE.radius
        (folder / "scene.xml").write_text(ROOM.format(far=far, bundle=folder / "lamp.plux"))
        size = (folder / "lamp.plux").stat().st_size
        line, last = f"{name:<18}{size / 1000:8.0f} kB", ""
        for which, words in commands().items():
            seconds, memory, code, text = called(words, folder, limit)
            refused = code == 2 and which != "validate"
            what = "refused" if refused else f"{seconds:6.1f} s"
            line += f"{what:>11}{memory:6.0f} MiB"
            last = text if refused else last
            if code and not refused:
                below = False
                line += f" (exit {code}: {text[:60]})"
            below &= seconds < (VALIDATE if which == "validate" else PICTURE)
            below &= which != "validate" or memory < MEMORY
        print(line, flush=True)
        if last:
            print(f"    {last.split(':', 2)[-1].strip()}", flush=True)
    return below


def main() -> int:
    """0 if every figure is below its bar."""
    parser = command.Parser(prog="python -m benchmarks.worst_bundles", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=[*BODIES, *SURFACES], metavar="NAME")
    parser.add_argument("--limit", type=command.number(0), default=300, help="seconds of a command")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(f"{'':<29}" + "".join(f"{n:>21}" for n in ("validate", "view", "accurate", "fast")))
    below = [row(name, options.limit) for name in options.only or [*BODIES, *SURFACES]]
    print("all below the bars" if all(below) else "ABOVE A BAR")
    return 0 if all(below) else 1


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.worst_bundles", main))
