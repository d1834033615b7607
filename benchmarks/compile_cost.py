"""Seconds in which Dr.Jit compiles networks, against what is foretold.

python -m benchmarks.compile_cost [--only Sin "table, 1 column"]

Every network is compiled once, in a process of its own, on one core and without the cache of
kernels. A foretold time that is too low would let a bomb pass; one that is too high refuses lamps.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from benchmarks.one_network import FLOAT, INT64, Body, Graph, layers, repeated, rows
from purelight_format import command
from purelight_mitsuba.platform import use

NETWORK, BAR = "appearance", 5.0


def remainders(g: Graph) -> tuple[str, int]:
    return g.node("Cast", g.indices(g.wide(256), 1000), to=FLOAT), 256


def table(lookups: int, columns: int) -> Body:
    def body(g: Graph) -> tuple[str, int]:
        values = g.constant(np.random.default_rng(0).random((1024, columns)))
        index = g.node("Cast", g.wide(lookups), to=INT64)
        return g.reshape(g.node("Gather", values, index), lookups * columns), lookups * columns

    return body


def chosen(width: int) -> Body:
    def body(g: Graph) -> tuple[str, int]:
        x = g.wide(width)
        return g.node("GatherElements", x, g.node("Cast", x, to=INT64), axis=1), width

    return body


def crowd(g: Graph) -> tuple[str, int]:
    """A layer of many inputs."""
    x = g.wide(512)
    return g.node("Concat", *[x] * 8, axis=1), 4096


BODIES: dict[str, Body] = {
    **{op: repeated(op, 256, 2) for op in ("Asin", "Atan", "Cos", "Exp", "Sigmoid", "Sin",
                                              "Softmax")},
    "Log": repeated("Log", 256, 1),
    "Sin, more": repeated("Sin", 256, 5),
    "Neg": repeated("Neg", 256, 40),
    "Mod": remainders,
    "table, 1 column": table(256, 1),
    "table, 4 columns": table(64, 4),
    "table, 4 columns, more": table(256, 4),
    "table, 8 columns": table(64, 8),
    "GatherElements": chosen(64),
    "GatherElements, more": chosen(120),
    "layers": layers(256, 8),
    "layers, more": layers(512, 5),
    "crowd": crowd,
}  # fmt: skip


def compiled(model: bytes) -> float:
    """Seconds until a network's first results."""
    import drjit as dr

    from purelight_mitsuba.translate.golden import lanes
    from purelight_mitsuba.translate.network import FusedNetwork

    network = FusedNetwork(model)
    values = [lanes(array) for array in rows(64).values()]
    start = time.perf_counter()
    dr.eval(*network(*values)[0].ravel())
    dr.sync_thread()
    return time.perf_counter() - start


def figures(name: str) -> tuple[float, float]:
    """Foretold and measured seconds."""
    use()
    import drjit as dr

    from purelight_mitsuba.translate import compile_cost

    dr.set_thread_count(0)
    g = Graph()
    model = g.model(*BODIES[name](g))
    return sum(compile_cost.seconds(model, NETWORK)), compiled(model)


def alone(name: str) -> tuple[float, float]:
    """The same in a new process, in whose empty home no kernel is kept."""
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as home:
        os.environ["HOME"] = home
        with ProcessPoolExecutor(1, mp_context=spawn) as pool:
            return pool.submit(figures, name).result()


def main() -> int:
    """0 if no network takes more than BAR times what is foretold."""
    parser = command.Parser(prog="python -m benchmarks.compile_cost", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(BODIES), metavar="NAME")
    names = parser.parse_args().only or list(BODIES)
    print(f"{'':<26}{'foretold':>10}{'measured':>10}{'ratio':>8}", flush=True)
    worst = 0.0
    for name in names:
        foretold, measured = alone(name)
        worst = max(worst, measured / foretold)
        print(f"{name:<26}{foretold:10.1f}{measured:10.1f}{measured / foretold:8.2f}", flush=True)
    return int(worst > BAR)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.compile_cost", main))
