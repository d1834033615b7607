"""Evaluations per second of a bundle's networks, as share of what the machine's cores multiply."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from onnx import TensorProto, helper, numpy_helper

from purelight_format.networks.vectors import SIGNATURES
from purelight_mitsuba.lamps.luminaire import Luminaire, load
from purelight_mitsuba.translate.golden import lanes
from purelight_mitsuba.translate.network import FusedNetwork
from purelight_onnx.session import Session

ROWS = 1 << 17
REPEATS = 3

Figures = dict[str, Any]


def network_speed(bundle: Path) -> Figures:
    """Million evaluations per second of every network by each engine, and shares of the peak."""
    luminaire = load(bundle)
    before = peak()
    figures = {name: _engines(luminaire, name) for name in SIGNATURES if luminaire.has(name)}
    best = max(before, peak())  # The machine may be busy with something else now and then.
    for engines in figures.values():
        macs = engines.pop("multiply_adds")
        for engine in engines.values():
            engine["share_of_peak"] = 2 * macs * engine["per_second"] / best
    return {"gemm_flops": best, "threads": dr.thread_count(), "networks": figures}


def peak(size: int = 512) -> float:
    """Floating-point operations per second of a matrix product in ONNX Runtime, on all threads."""
    matrix = np.random.default_rng(0).random((size, size), np.float32)
    x, y = (helper.make_tensor_value_info(n, TensorProto.FLOAT, ["N", size]) for n in "xy")
    node = helper.make_node("Gemm", ["x", "w"], ["y"])
    graph = helper.make_graph([node], "peak", [x], [y], [numpy_helper.from_array(matrix, "w")])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    session = Session(model.SerializeToString(), threads=dr.thread_count())
    rows = {"x": np.random.default_rng(1).random((1 << 15, size), np.float32)}
    return 2 * (1 << 15) * size * size / seconds(lambda: session(rows))


def _engines(luminaire: Luminaire, name: str) -> Figures:
    rows = _inputs(luminaire, name)
    values = [lanes(array) for array in rows.values()]
    network, session = luminaire.network(name), luminaire.session(name)
    return {
        "multiply_adds": luminaire.cost(name),
        "fused": {"per_second": ROWS / fused_seconds(network, values)},
        "onnxruntime": {"per_second": ROWS / seconds(lambda: session(rows))},
    }


def fused_seconds(network: FusedNetwork, values: Sequence[Any]) -> float:
    """Seconds in which Dr.Jit evaluates a network in a kernel of its own."""

    def fused() -> None:
        total = mi.Float(0)  # One output instead of hundreds keeps the memory out of it.
        for output in network(*values):
            for column in output.ravel():
                total = total + column
        dr.eval(total)
        dr.sync_thread()

    return seconds(fused)


def _inputs(luminaire: Luminaire, name: str) -> dict[str, np.ndarray]:
    """Places on a shell inside the sphere, or points between one and ten radii."""
    rng, sphere = np.random.default_rng(0), luminaire.sphere
    away = rng.normal(size=(ROWS, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    centre, far = np.array(sphere.center), np.exp(rng.uniform(0.1, 2.3, (ROWS, 1)))
    made = {
        "position": centre + 0.9 * sphere.radius * away,
        "point": centre + sphere.radius * far * away,
        "normal": away, "outgoing": away, "toward": -away, "u": rng.random((ROWS, 2)),
    }  # fmt: skip
    return {key: made[key].astype(np.float32) for key in SIGNATURES[name].inputs}


def seconds(function: Callable[[], Any]) -> float:
    """The best of some runs, after one that compiles."""
    function()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)
