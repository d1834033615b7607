"""The smallest bundle, made of numbers that every machine adds exactly; spec/example.plux."""

from __future__ import annotations

import math

import numpy as np
import onnx

from purelight_format import bundle
from purelight_format.measures import BoundingSphere
from purelight_format.members import container
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import SIGNATURES, Vectors
from tests.support import bundles, lamp

# Two triangles, 1 m by 1 m, that shine upwards.
CORNERS = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]], np.float32)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
FLUX = (4 * math.pi / 3, 2 * math.pi / 3, math.pi / 3)  # The radiance below, integrated.
WEIGHT = np.array([[0, 0, 2], [0, 0, 1], [0, 0, 0.5]], np.float32)
BIAS = np.zeros(3, np.float32)


def appearance() -> bytes:
    """radiance = max(0, W outgoing): brighter straight up."""
    node = onnx.helper.make_node
    nodes = [node("Gemm", ["outgoing", "weight", "bias"], ["linear"], transB=1),
             node("Relu", ["linear"], ["radiance"])]  # fmt: skip
    proto = lamp.model("appearance", nodes, {"weight": WEIGHT, "bias": BIAS})
    return bytes(proto.SerializeToString(deterministic=True))


def golden(model: bytes) -> Vectors:
    """Two vectors: straight up, and towards the horizon, at the surface's middle."""
    up = np.array([[0, 0, 1], [0, 0, 1]], np.float32)
    outgoing = np.array([[0, 0, 1], [0.75, 0.5, 0.25]], np.float32)
    inputs = dict(zip(SIGNATURES["appearance"].inputs, (0 * up, up, outgoing), strict=True))
    return bundles.vectors("appearance", model, inputs, lambda y: 2.0**-13 + 0 * y)


def parts() -> dict[str, bytes]:
    """The members in their order."""
    model = appearance()
    flux = np.tile(np.array(FLUX, np.float32) / 2, (2, 1))
    manifest, content = bundles.parts(
        Surface(CORNERS, TRIANGLES, flux),
        {"appearance": (model, golden(model))},
        name="Smallest",
        bounding_sphere=BoundingSphere((0.0, 0.0, 0.0), 0.75),
        flux=FLUX,
        radiance_scale=7 / 9,  # Mean of the channels' flux over pi m2.
        r_max=15.0,
        channels=(True, True, True),
    )
    return bundle.arrange(manifest, content)


def data() -> bytes:
    """The file."""
    return container.pack(parts())
