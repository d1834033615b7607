"""Small lamps with wild weights, and a way to run a piece of a graph."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from purelight_export.graph import Graph, Value
from purelight_onnx.session import Session
from purelight_train.light.description import Description
from purelight_train.presets import Preset
from tests.support import untrained

Piece = Callable[..., Value]


@pytest.fixture(autouse=True)
def _single_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.manual_seed(7)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="session")
def run() -> Callable[..., np.ndarray]:
    """Evaluates a piece on inputs [N, D] with ONNX Runtime."""

    def evaluate(piece: Piece, *inputs: np.ndarray) -> np.ndarray:
        graph = Graph("piece")
        values = [graph.input(f"x{i}", array.shape[1]) for i, array in enumerate(inputs)]
        graph.output("y", piece(graph, *values))
        feed = {f"x{i}": array.astype(np.float32) for i, array in enumerate(inputs)}
        return Session(graph.to_bytes())(feed)["y"]

    return evaluate


@pytest.fixture(scope="session")
def preset() -> Preset:
    return untrained.PRESET


@pytest.fixture(scope="session")
def description() -> Description:
    return untrained.DESCRIPTION


@pytest.fixture(scope="session")
def wild() -> Any:
    return untrained.wild


@pytest.fixture(scope="session")
def unit() -> Callable[..., np.ndarray]:
    """Random unit vectors, the six axes first."""

    def vectors(count: int, seed: int = 0) -> np.ndarray:
        v = np.random.default_rng(seed).standard_normal((count, 3))
        v[:6] = np.concatenate([np.eye(3), -np.eye(3)])[: len(v[:6])]
        return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)

    return vectors


@pytest.fixture(scope="session")
def run_directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run whose lamp is a ball and whose networks were never trained."""
    return untrained.write(tmp_path_factory.mktemp("run"))
