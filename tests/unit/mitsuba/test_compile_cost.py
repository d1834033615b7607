"""Networks that Mitsuba would compile for minutes are refused before it begins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.translate.compile_cost import ELEMENTS, LAYERS, require_compilable, seconds
from tests.assets import bad
from tests.assets.bad import APPEARANCE, one
from tests.support import lamp


def wide(*made: Any, width: int, **constants: Any) -> bytes:
    """A valid lamp with nodes behind a wide value `w` in its appearance network."""
    weight = np.ones((3, width), np.float32)
    return bad.nodes(one("MatMul", "position weight", "w"), *made, weight=weight, **constants)


def picked(width: int) -> bytes:
    """Columns of a row in an order that is computed."""
    index = one("Cast", "w", "i", to=TensorProto.INT32)
    return wide(index, one("Mod", "i d", "j"), one("GatherElements", "w j", "z", axis=1),
                width=width, d=np.array([width], np.int32))  # fmt: skip


BOMBS = {
    "columns chosen among all others": lambda: picked(2566),
    "thousands of sines": lambda: wide(one("Sin", "w"), width=4096),
    "a crowd of columns": lambda: wide(one("MatMul", "w m"), width=30_000,
                                       m=np.ones((30_000, 1), np.float32)),
}  # fmt: skip


@pytest.mark.parametrize("name", BOMBS)
def test_a_valid_bomb_is_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / "lamp.plux"
    path.write_bytes(BOMBS[name]())
    luminaire = Luminaire(Bundle.open(path))
    with pytest.raises(PureLightError, match=r"lamp\.plux: appearance: Mitsuba would compile"):
        luminaire.network("appearance")


def test_operands_that_repeat_do_not_multiply() -> None:
    """Add(x, x) forty times is forty operations on three columns, not 2^40."""
    made = [one("Add", f"x{k} x{k}", f"x{k + 1}") for k in range(40)]
    data = bad.member_of(bad.nodes(one("Identity", "position", "x0"), *made), APPEARANCE)
    assert seconds(data, "appearance")[0] < 0.1


@pytest.mark.parametrize("network", list(lamp.NETWORKS))
def test_networks_of_a_lamp_pass(network: str) -> None:
    data = lamp.NETWORKS[network]().SerializeToString()
    require_compilable(data, network, "lamp")
    elements, layers = seconds(data, network)
    assert 0 < elements < ELEMENTS
    assert 0 <= layers < LAYERS
