"""A tiny lamp made by code: an octahedron with networks of a few nodes."""

from __future__ import annotations

import base64
import functools
import hashlib
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from purelight_format import bundle
from purelight_format.measures import BoundingSphere
from purelight_format.members import container
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import SIGNATURES, Vectors
from tests.support import bundles
from tests.support.bundles import Members, Parts

SPHERE = BoundingSphere((0.0, 0.0, 0.5), 0.1)
FLUX = (4.0, 2.0, 1.0)
SCALE = 10.0
PNG = base64.b64decode(  # One grey pixel.
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="
)
Nodes = list[onnx.NodeProto]


def model(network: str, nodes: Nodes, constants: Mapping[str, Any]) -> onnx.ModelProto:
    """A network with its proper inputs and outputs."""
    inputs, outputs = (
        [helper.make_tensor_value_info(k, TensorProto.FLOAT, ["N", *v]) for k, v in shapes.items()]
        for shapes in SIGNATURES[network]
    )
    tensors = [numpy_helper.from_array(np.asarray(v), name) for name, v in constants.items()]
    graph = helper.make_graph(nodes, network, inputs, outputs, tensors)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)


def _dense(rng: np.random.Generator, size: int, width: int) -> np.ndarray:
    return (rng.standard_normal((width, size)) / np.sqrt(size)).astype(np.float32)


def surface_network(network: str, last: Nodes) -> onnx.ModelProto:
    """Two layers on position, normal and outgoing; `last` turns y [N, 3] into the output."""
    rng = np.random.default_rng(3)
    node = helper.make_node
    nodes = [
        node("Concat", ["position", "normal", "outgoing"], ["x"], axis=1),
        node("Gemm", ["x", "w0", "b0"], ["h0"], transB=1),
        node("Relu", ["h0"], ["h1"]),
        node("Gemm", ["h1", "w1", "b1"], ["y"], transB=1),
    ]
    constants = {
        "w0": _dense(rng, 9, 8), "b0": np.zeros(8, np.float32),
        "w1": _dense(rng, 8, 3), "b1": np.ones(3, np.float32),
    }  # fmt: skip
    return model(network, [*nodes, *last], constants)


def appearance() -> onnx.ModelProto:
    return surface_network("appearance", [helper.make_node("Exp", ["y"], ["radiance"])])


def transparency() -> onnx.ModelProto:
    last = helper.make_node("Sigmoid", ["y"], ["transmittance"])
    return surface_network("transparency", [last])


def _toward_centre(network: str, toward: str) -> onnx.ModelProto:
    node = helper.make_node
    nodes = [
        node("Sub", ["centre", "point"], ["offset"]),
        node("Mul", ["offset", "offset"], ["squares"]),
        node("ReduceSum", ["squares", "last"], ["square"], keepdims=1),
        node("Sqrt", ["square"], ["distance"]),
        node("Div", ["offset", "distance"], [toward]),
        node("Squeeze", ["square", "last"], ["pdf_solid_angle"]),
    ]
    constants = {"centre": np.array(SPHERE.center, np.float32), "last": np.array([1])}
    return model(network, nodes, constants)


def sampler() -> onnx.ModelProto:
    return _toward_centre("sampler", "toward")


def sampler_pdf() -> onnx.ModelProto:
    return _toward_centre("sampler_pdf", "axis")


def fast_map() -> onnx.ModelProto:
    node = helper.make_node
    nodes = [
        node("Gemm", ["point", "w", "b"], ["flat"], transB=1),
        node("Reshape", ["flat", "shape"], ["planes"]),
        node("Transpose", ["planes"], ["radiance_map"], perm=[0, 2, 3, 1]),
    ]
    constants = {
        "w": np.zeros((768, 3), np.float32), "b": np.ones(768, np.float32),
        "shape": np.array([-1, 3, 16, 16]),
    }  # fmt: skip
    return model("fast_map", nodes, constants)


NETWORKS: dict[str, Callable[[], onnx.ModelProto]] = {
    "appearance": appearance,
    "transparency": transparency,
    "sampler": sampler,
    "sampler_pdf": sampler_pdf,
    "fast_map": fast_map,
}


def surface() -> Surface:
    """An octahedron around the centre of the sphere."""
    corners = np.concatenate((np.eye(3), -np.eye(3))) * 0.99 * SPHERE.radius + SPHERE.center
    signs = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    triangles = np.array(signs, np.uint32)
    flux = np.tile(np.array(FLUX) / len(triangles), (len(triangles), 1))
    return Surface(corners.astype(np.float32), triangles, flux.astype(np.float32))


def golden(network: str, data: bytes, count: int = 8) -> Vectors:
    """Golden vectors of a network at random inputs."""
    rng = np.random.default_rng(5)
    shapes = SIGNATURES[network].inputs
    inputs = {k: rng.random((count, *v)).astype(np.float32) for k, v in shapes.items()}
    return bundles.vectors(network, data, inputs, lambda y: 1e-4 * np.abs(y))


@functools.cache
def parts() -> Parts:
    """The manifest and the members from which the lamp is written."""
    models = {name: make().SerializeToString() for name, make in NETWORKS.items()}
    manifest, content = bundles.parts(
        surface(),
        {name: (data, golden(name, data)) for name, data in models.items()},
        name="Octahedron",
        bounding_sphere=SPHERE,
        flux=FLUX,
        radiance_scale=SCALE,
        r_max=15.0,
        channels=(True, True, True),
        provenance={"scene": "octahedron.xml", "seed": 7},
        fidelity={"relative_error": 0.02},
    )
    return manifest, content | {"photometry.ies": b"IES:LM-63-2019\r\n", "preview.png": PNG}


def good() -> Members:
    """All members of the lamp in their order, ready to be spoilt and sealed."""
    manifest, content = parts()
    return bundle.arrange(manifest, content)


def seal(content: Members, edit: Callable[[dict[str, Any]], None] | None = None) -> bytes:
    """Packs members with a manifest that lists them as they are, after an edit of its JSON."""
    value = json.loads(content["manifest.json"])
    value["members"] = {
        name: {"size": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        for name, data in content.items()
        if name != "manifest.json"
    }
    if edit:
        edit(value)
    return container.pack({**content, "manifest.json": json.dumps(value).encode()})


def seal_as_written() -> bytes:
    """The file that `bundle.write` makes of the lamp."""
    return container.pack(good())
