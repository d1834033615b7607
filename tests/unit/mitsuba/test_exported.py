"""Networks as the exporter writes them, by Dr.Jit and by ONNX Runtime."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import torch
from torch import nn

from purelight_export import networks
from purelight_mitsuba.translate.network import FusedNetwork
from purelight_onnx.session import Session
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from tests.support import untrained

CENTRE, RADIUS = untrained.SPHERE.center, untrained.SPHERE.radius
ROWS = 512


@pytest.fixture(autouse=True)
def _single_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def unit(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=(ROWS, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def queries(names: list[str]) -> dict[str, np.ndarray]:
    """Surface points, shading points from inside to a million radii, and directions."""
    rng = np.random.default_rng(3)
    radii = np.exp(rng.uniform(0.1, np.log(14), (ROWS, 1)))
    radii[:5] = np.array([[1e6], [1.01], [0.999], [0.5], [0.0]])
    point = CENTRE + RADIUS * radii * unit(rng)
    aim = CENTRE + 0.7 * RADIUS * unit(rng) - point
    known = {
        "position": CENTRE + 0.9 * RADIUS * unit(rng),
        "normal": unit(rng),
        "outgoing": unit(rng),
        "point": point,
        "u": rng.random((ROWS, 2)),
        "toward": aim / np.linalg.norm(aim, axis=1, keepdims=True),
    }
    known["u"][:6] = np.array([[0, 0], [1 - 2**-24] * 2, [0, 0.5], [0.5, 0], [0.05, 1], [1, 1]])
    return {name: known[name].astype(np.float32) for name in names}


def evaluate(model: bytes, inputs: dict[str, np.ndarray]) -> list[np.ndarray]:
    """All outputs by Dr.Jit, each [N, D]."""
    vectors = {2: mi.Point2f, 3: mi.Point3f}
    outputs = FusedNetwork(model)(*(vectors[a.shape[1]](a.T) for a in inputs.values()))
    flat = [[x + dr.zeros(mi.Float, ROWS) for x in columns.ravel()] for columns in outputs]
    dr.eval(flat)
    return [np.stack([np.array(x) for x in columns], 1) for columns in flat]


@pytest.mark.parametrize("compact", [False, True])
@pytest.mark.parametrize(
    ("kind", "export", "names"),
    [
        (Student, networks.appearance, ["position", "normal", "outgoing"]),
        (Transparency, networks.transparency, ["position", "normal", "outgoing"]),
        (Sampler, networks.sampler, ["point", "u"]),
        (Sampler, networks.sampler_pdf, ["point", "toward"]),
        (FastMap, networks.fast_map, ["point"]),
    ],
    ids=["appearance", "transparency", "sampler", "sampler_pdf", "fast_map"],
)
def test_same_answers_as_onnx_runtime(
    kind: type[nn.Module], export: Any, names: list[str], compact: bool
) -> None:
    model = export(untrained.wild(kind), compact=compact)
    inputs = queries(names)
    expected = Session(model)(inputs).values()
    for ours, theirs in zip(evaluate(model, inputs), expected, strict=True):
        assert np.isfinite(ours).all()
        scale = np.abs(theirs.reshape(ROWS, -1)).mean()
        # A bin of a spline may be chosen differently by rounding, in one row of hundreds.
        wrong = np.abs(ours - theirs.reshape(ROWS, -1)) > 1e-3 * (
            np.abs(theirs.reshape(ROWS, -1)) + 0.1 * scale
        )
        assert wrong.any(1).sum() <= 2
