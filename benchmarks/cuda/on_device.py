"""What a variant is asked to do, in a process in which no other was ever set."""

from __future__ import annotations

import warnings
from itertools import pairwise
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from onnx import TensorProto, helper, numpy_helper

from benchmarks.network_speed import fused_seconds, peak, seconds
from purelight_format.bundle import Bundle
from purelight_format.networks.vectors import SIGNATURES
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.output import first_hit
from purelight_mitsuba.translate.golden import Arrays, ReducedPrecisionWarning, evaluate, lanes
from purelight_mitsuba.translate.network import FusedNetwork
from tests.support.agreement import passes

SIZE, SPP, DEPTH = 32, 64, 4
HEIGHT = 3.0
INPUTS, HIDDEN = 9, 4


def traced() -> float:
    """The largest error of distances to a square, in metres."""
    square = mi.load_dict({"type": "scene", "square": {"type": "rectangle"}})
    x, y = dr.meshgrid(*2 * [dr.linspace(mi.Float, -0.9, 0.9, 64)])
    ray = mi.Ray3f(mi.Point3f(x, y, HEIGHT), mi.Vector3f(0, 0, -1))
    return float(np.abs(square.ray_intersect(ray).t.numpy() - HEIGHT).max())


def answers(lamp: Path, name: str, half: bool) -> Arrays:
    """Outputs of a network for the inputs of its golden vectors."""
    bundle = Bundle.open(lamp)
    model = bundle.read(bundle.manifest.networks[name].member)
    network = FusedNetwork(model, name=f"{lamp}: {name}", half=half)
    return evaluate(network, name, bundle.vectors(name).inputs)


def layers(lamp: Path, spheres: bool) -> Arrays:
    """What the camera meets first, found in the room and among the lamps by one kernel."""
    return first_hit.layers(room(lamp, spheres))


def pictures(lamp: Path, mode: str, engine: str, first: int) -> np.ndarray:
    """Independent renderings of the room: [passes, blocks, blocks, 3]."""
    warnings.simplefilter("ignore", ReducedPrecisionWarning)
    return passes(room(lamp), _integrator(mode, engine), SPP, first=first)


def loop_seconds(lamp: Path, spp: int) -> dict[str, float]:
    """Seconds of a rendering with symbolic and with evaluated loops."""
    warnings.simplefilter("ignore", ReducedPrecisionWarning)
    scene = room(lamp)

    def timed(symbolic: bool) -> float:
        for flag in (dr.JitFlag.SymbolicLoops, dr.JitFlag.SymbolicCalls):
            dr.set_flag(flag, symbolic)
        made = mi.load_dict(_integrator("accurate", "fused"))
        return seconds(lambda: _finish(mi.render(scene, integrator=made, spp=spp)))

    return {"symbolic": timed(True), "evaluated": timed(False)}


def calls(width: int = 32, rows: int = 1 << 16) -> dict[str, float]:
    """A network beside the same in a virtual call: largest difference of radiance, and seconds."""
    network, values = FusedNetwork(mlp(width)), directions(rows)
    index = mi.UInt32(np.arange(rows) % 2)

    def lit(*surface: Any) -> Any:
        return mi.Color3f(*network(*surface)[0])

    def inline() -> Any:
        return dr.select(index == 0, lit(*values), 0)

    def called() -> Any:
        return dr.switch(index, [lit, lambda *_: mi.Color3f(0)], *values)

    return {
        "difference": float(np.abs(np.array(inline()) - np.array(called())).max()),
        "inline": seconds(lambda: _finish(inline())),
        "called": seconds(lambda: _finish(called())),
    }


def speed(width: int, rows: int) -> dict[str, float]:
    """Evaluations per second of a network `HIDDEN` layers deep, beside a matrix product."""
    macs = width * (INPUTS + (HIDDEN - 1) * width + 3)
    rate = rows / fused_seconds(FusedNetwork(mlp(width)), directions(rows))
    return {"per_second": rate, "flops": 2 * macs * rate, "gemm_flops": gemm_flops()}


def gemm_flops() -> float:
    """Operations per second of large matrix products, in the precision of dense layers.

    On CUDA these are Dr.Jit's own, elsewhere ONNX Runtime's.
    """
    if dr.backend_v(mi.Float) != dr.JitBackend.CUDA:
        return peak()
    size = 8192
    matrix = dr.full(mi.TensorXf16, 1 / size, (size, size))
    dr.eval(matrix)
    return 2 * size**3 / seconds(lambda: _finish(matrix @ matrix))


def mlp(width: int) -> bytes:
    """An appearance network of random layers, `HIDDEN` of them `width` wide."""
    rng, sizes = np.random.default_rng(width), [INPUTS, *[width] * HIDDEN, 3]
    names = list(SIGNATURES["appearance"].inputs)
    nodes, constants = [helper.make_node("Concat", names, ["x0"], axis=1)], []
    for k, (a, b) in enumerate(pairwise(sizes)):
        weight = rng.normal(size=(b, a)) * np.sqrt(2 / a)
        for name, array in ((f"w{k}", weight), (f"b{k}", rng.normal(size=b) / 4)):
            constants.append(numpy_helper.from_array(array.astype(np.float32), name))
        result = "radiance" if k == HIDDEN else f"y{k}"
        nodes.append(helper.make_node("Gemm", [f"x{k}", f"w{k}", f"b{k}"], [result], transB=1))
        if k < HIDDEN:
            nodes.append(helper.make_node("Relu", [result], [f"x{k + 1}"]))
    tensors = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", 3])
        for name in (*names, "radiance")
    ]
    graph = helper.make_graph(nodes, "mlp", tensors[:-1], tensors[-1:], constants)
    opset = [helper.make_opsetid("", 18)]
    model: bytes = helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()
    return model


def directions(rows: int) -> list[Any]:
    """Random unit vectors for the inputs of an appearance network."""
    away = np.random.default_rng(0).normal(size=(3, rows, 3))
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    values = [lanes(vectors.astype(np.float32)) for vectors in away]
    dr.eval(values)
    return values


def room(lamp: Path, spheres: bool = False) -> mi.Scene:
    """A lamp of 60 cm with a small light of Mitsuba's.

    Arguments:
        spheres: Whether there is no triangle in the room, which then needs no ray-tracing program
            for triangles of its own.
    """
    t, sphere = mi.ScalarTransform4f, load(lamp).sphere
    hung = t().translate([0, 0, 0.1]).scale(0.3 / sphere.radius)
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}}
    seen = t().look_at([1.3, 0.9, 0.9], [0, 0, 0], [0, 0, 1])
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.5, 0.4]}}
    light = {"type": "area", "radiance": {"type": "rgb", "value": [1.0, 2.0, 4.0]}}
    bulb = {"type": "sphere", "center": [-0.8, 0.8, 0.6], "radius": 0.1, "emitter": light}
    ball = {"type": "sphere", "center": [0.5, 0.7, -0.3], "radius": 0.3, "bsdf": grey}
    flat = {
        "floor": {"type": "rectangle", "to_world": t().translate([0, 0, -0.6]).scale(1.5)},
        "box": {"type": "cube", "to_world": t().translate([-0.8, -0.4, -0.3]).scale(0.3)},
    }
    ground = {"ground": {"type": "sphere", "center": [0, 0, -20.6], "radius": 20.0}}
    shapes = {name: shape | {"bsdf": grey} for name, shape in (ground if spheres else flat).items()}
    return mi.load_dict({
        "type": "scene", "bulb": bulb, "ball": ball, **shapes,
        "sensor": {"type": "perspective", "fov": 40, "film": film, "to_world": seen},
        "lamp": {
            "type": "purelight", "filename": str(lamp),
            "to_world": hung.translate([-x for x in sphere.center]),
        },
    })  # fmt: skip


def _integrator(mode: str, engine: str) -> dict[str, Any]:
    return {"type": "purelight", "mode": mode, "engine": engine, "max_depth": DEPTH}


def _finish(value: Any) -> None:
    dr.eval(value)
    dr.sync_thread()
