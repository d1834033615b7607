"""Tiers: what keeps a network from being portable; a bundle cannot claim what it is not."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper

from purelight_format.members import manifest
from purelight_format.networks import tiers
from purelight_format.networks.profile import inspect
from purelight_format.validation.validate import validate
from tests.support import lamp, smallest

node = helper.make_node
OUT = node("Identity", ["y"], ["radiance"])


def network(width: int, *more: Any, depth: int = 1, **constants: Any) -> bytes:
    """An appearance of hidden layers, with nodes between `h` [N, width] and `y` [N, 3]."""
    sizes = {"w": (width, 3), "b": (width,), "v": (width, width), "last": (3, width), "c": (3,)}
    weights: dict[str, Any] = {name: np.ones(size, np.float32) for name, size in sizes.items()}
    nodes = [node("Gemm", ["position", "w", "b"], ["g0"], transB=1), node("Relu", ["g0"], ["h0"])]
    for k in range(1, depth):
        nodes += [node("Gemm", [f"h{k - 1}", "v", "b"], [f"g{k}"], transB=1),
                  node("Relu", [f"g{k}"], [f"h{k}"])]  # fmt: skip
    nodes += [node("Identity", [f"h{depth - 1}"], ["h"]), *more,
              node("Gemm", ["h", "last", "c"], ["y"], transB=1), OUT]  # fmt: skip
    model = lamp.model("appearance", nodes, weights | constants).SerializeToString()
    inspect(model, "appearance")
    return bytes(model)


CASES: dict[str, tuple[bytes, str]] = {
    "fits": (network(32, depth=2), ""),
    "narrow": (network(8), "a layer of 8"),
    "deep": (network(64, depth=3), "8,576 multiply-adds"),
    "large": (network(16, node("Reshape", ["h", "tall"], ["t"]), node("Mul", ["t", "wide"], ["p"]),
                      tall=np.array([-1, 16, 1]), wide=np.ones((1, 1100), np.float32)), "values"),
    "integers": (network(16, node("Cast", ["h"], ["i"], to=TensorProto.INT64)),
                 "integers of 64 bits"),
    "packed": (network(16, node("Cast", ["h"], ["i"], to=TensorProto.INT32),
                       node("Gather", ["t", "i"], ["r"]), t=np.arange(9, dtype=np.int32)),
               "a table of integers"),
    "heavy": (network(16, node("Cast", ["h"], ["i"], to=TensorProto.INT32),
                      node("Gather", ["t", "i"], ["r"]),
                      t=np.zeros((1 << 22, 1), np.float32)), "weights"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_keeps_a_network_from_the_tier(case: str) -> None:
    model, reason = CASES[case]
    found = tiers.fault(tiers.PORTABLE, model, "appearance")
    assert reason in found
    assert (found == "") == (reason == "")


def test_a_map_may_take_more() -> None:
    assert tiers.most_macs(tiers.PORTABLE, "fast_map") > tiers.most_macs(tiers.PORTABLE, "sampler")


def stated(content: dict[str, bytes], tier: Any) -> list[str]:
    """Issues of a bundle that states a tier."""
    report = validate(lamp.seal(content, lambda root: root.update(tier=tier)))
    return [f"{issue.code.name} {issue.location}" for issue in report.issues]


def test_a_bundle_states_what_it_keeps_to() -> None:
    assert stated(smallest.parts(), "portable") == []
    assert stated(lamp.good(), "portable") == ["PLX_MANIFEST_COST_MISMATCH manifest.json/tier"] * 2
    assert stated(lamp.good(), "of next year") == []
    assert stated(lamp.good(), 3) == ["PLX_MANIFEST_SCHEMA manifest.json/tier"]
    assert stated(lamp.good(), "two\nlines") == ["PLX_MANIFEST_SCHEMA manifest.json/tier"]


def test_the_manifest_keeps_it() -> None:
    found, _ = lamp.parts()
    for tier in (None, "portable", "of next year"):
        written = {**manifest.to_json(found), **({} if tier is None else {"tier": tier})}
        again, issues = manifest.examine(json.dumps(written).encode())
        assert issues == []
        assert again is not None
        assert again.tier == tier
        assert manifest.to_json(again) == written
