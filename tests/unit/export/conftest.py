"""Small lamps with wild weights, and a way to run a piece of a graph."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from torch import nn

from purelight_export.graph import Graph, Value
from purelight_export.networks import EXPORTED
from purelight_format.measures import BoundingSphere
from purelight_onnx.session import Session
from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP, GridEncoding
from purelight_train.presets import DRAFT, FlowSize, GridSize, MLPSize, Preset
from purelight_train.runs.run_directory import RunDirectory

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
    """A preset with a hashed level, small enough to build in no time."""
    return replace(
        DRAFT,
        name="test",
        student_grid=GridSize(4, 2, 4, 40, 1 << 12),
        student_network=MLPSize(16, 2),
        transparency_grid=GridSize(2, 3, 4, 8, 1 << 10),
        transparency_network=MLPSize(8, 1),
        point_grid=GridSize(2, 4, 2, 6, 1 << 9),
        sampler_flow=FlowSize(2, MLPSize(16, 1), 8),
        fast_map_network=MLPSize(16, 1),
    )


@pytest.fixture(scope="session")
def description() -> Description:
    sphere = BoundingSphere((0.1, -0.2, 0.3), 0.25)
    return Description(sphere, (3.0, 2.0, 1.0), (0.0, 0.0, 0.0), 7.5, (True, True, True), 0.4, 1)


@pytest.fixture(scope="session")
def wild() -> Callable[[type[nn.Module], Description, Preset], Any]:
    """Makes a network with weights as large as a trained one's, so that errors show."""

    def make(kind: type[nn.Module], description: Description, preset: Preset) -> Any:
        torch.manual_seed(11)
        module = kind(description, preset)
        for part in module.modules():
            if isinstance(part, GridEncoding):
                nn.init.uniform_(part.table, -1, 1)
            if isinstance(part, MLP):
                nn.init.normal_(part[-1].weight, 0, 0.5)
                nn.init.normal_(part[-1].bias, 0.5, 0.5)
        return module.eval()

    return make


@pytest.fixture(scope="session")
def unit() -> Callable[..., np.ndarray]:
    """Random unit vectors, the six axes first."""

    def vectors(count: int, seed: int = 0) -> np.ndarray:
        v = np.random.default_rng(seed).standard_normal((count, 3))
        v[:6] = np.concatenate([np.eye(3), -np.eye(3)])[: len(v[:6])]
        return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)

    return vectors


@pytest.fixture(scope="session")
def run_directory(
    tmp_path_factory: pytest.TempPathFactory, preset: Preset, description: Description, wild: Any
) -> Path:
    """A finished run whose lamp is a ball and whose networks were never trained."""
    run = RunDirectory(tmp_path_factory.mktemp("run"))
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=description.sphere.radius * 0.999)
    positions = (mesh.vertices + np.array(description.sphere.center)).astype(np.float32)
    flux = np.tile(np.array(description.flux) / len(mesh.faces), (len(mesh.faces), 1))
    rng = np.random.default_rng(0)
    direction = rng.standard_normal((20_000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    weight = np.tile(np.array(description.flux) / len(direction), (len(direction), 1))
    run.write_json(
        "config.json",
        {"luminaire": "/home/someone/lamp.xml", "digest": "0" * 64, "seed": 1, "route": "teacher",
         "preset": preset.to_dict()},
    )  # fmt: skip
    run.write_json("description.json", description.to_dict())
    run.write_json("metrics.json", {"held_out_gain_nats": 1.5, "losses": {"student": [1.0]}})
    run.write_arrays(
        "surface.npz", positions=positions, triangles=mesh.faces.astype(np.uint32),
        triangle_flux=(0.99 * flux).astype(np.float32),
    )  # fmt: skip
    run.write_arrays("escaped.npz", direction=direction, weight=weight.astype(np.float32))
    for made in EXPORTED.values():
        run.save(made.trained, wild(made.module, description, preset), {})
    return run.path
