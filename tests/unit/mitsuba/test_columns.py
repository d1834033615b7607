"""Columns picked from an output are those of the whole output."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from onnx import helper
from test_fused import ROWS, model, node

from purelight_mitsuba.columns import ColumnPicker
from purelight_mitsuba.fused import FusedNetwork

RNG = np.random.default_rng(3)
LAYERS = {
    f"{kind}{k}": RNG.normal(size=shape).astype(np.float32)
    for k in range(3)
    for kind, shape in (("w", (8, 6)), ("b", (8,)))
}
HEADS = [node("Concat", "x y", "c", axis=1)] + [
    helper.make_node("Gemm", ["c", f"w{k}", f"b{k}"], [f"h{k}"], transB=1) for k in range(3)
]
CHANNELS_LAST = [
    node("Reshape", "s sizes", "r"),
    node("Transpose", "r", "z", perm=[0, 2, 3, 1]),
]
SIZES = {"sizes": np.array([-1, 3, 2, 4], np.int64)}


def differences(network: bytes, columns: int) -> np.ndarray:
    """Largest difference between picked columns and those of the whole output, by row."""
    x, y = RNG.normal(size=(2, 3, ROWS)).astype(np.float32)
    translated = FusedNetwork(network)
    (whole,) = translated(mi.Point3f(x), mi.Point3f(y))
    whole = np.stack([np.array(value + dr.zeros(mi.Float, ROWS)) for value in whole.ravel()])
    tables = [np.arange(columns), RNG.permutation(columns)[:5]]
    choice = RNG.integers(0, 5, ROWS)
    looks = ColumnPicker(translated, tables)(mi.Point3f(x), mi.Point3f(y))
    picked = [look(mi.UInt32(choice)) for look in looks]
    expected = [whole[table[choice], np.arange(ROWS)] for table in tables]
    return np.abs(np.array([np.array(p) for p in picked]) - expected)


def test_a_map_of_three_heads() -> None:
    nodes: list[Any] = [
        *HEADS,
        node("Concat", "h0 h1 h2", "j", axis=1),
        node("Clip", "j low high", "k"),
        node("Exp", "k", "e"),
        node("Sub", "e one", "d"),
        node("Mul", "d gain", "s"),
        *CHANNELS_LAST,
    ]
    constants = LAYERS | SIZES | {"low": np.float32(-1), "high": np.float32(1)}
    constants |= {"one": np.float32(1), "gain": RNG.random(24).astype(np.float32)}
    network = model(nodes, constants, (2, 4, 3))
    assert differences(network, 24).max() < 1e-5
    picker = ColumnPicker(FusedNetwork(network), [3 * np.arange(8) + 1])
    x = mi.Point3f(0.1, 0.2, 0.3)
    assert len(picker(x, x)) == 1


@pytest.mark.parametrize("last", ["Softmax", "Add"])
def test_what_cannot_be_pushed_up_is_evaluated_whole(last: str) -> None:
    inputs = "h0" if last == "Softmax" else "h0 h1"
    assert differences(model([*HEADS, node(last, inputs)], LAYERS, (8,)), 8).max() < 1e-5


def test_only_chosen_rows_of_the_last_layer_are_computed() -> None:
    """The layer of all columns is never asked for."""
    nodes = [*HEADS[:2], node("Exp", "h0", "z")]
    network = FusedNetwork(model(nodes, LAYERS, (8,)))
    asked: list[str] = []
    whole = network.partly

    def spied(*inputs: Any) -> Any:
        evaluate = whole(*inputs)
        return lambda name: (asked.append(name), evaluate(name))[1]

    network.partly = spied  # type: ignore[method-assign]
    x = mi.Point3f(0.1, 0.2, 0.3)
    (look,) = ColumnPicker(network, [np.arange(8)])(x, x)
    look(mi.UInt32(2))
    assert asked == ["c"]
