"""Networks of a small lamp that were never trained, and the run directory that holds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from torch import nn

from purelight_export.networks import EXPORTED
from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.networks.encodings import MLP, GridEncoding
from purelight_train.presets import DRAFT, FlowSize, GridSize, MLPSize, Preset
from purelight_train.runs.run_directory import RunDirectory

SPHERE = BoundingSphere((0.1, -0.2, 0.3), 0.25)
DESCRIPTION = Description(
    SPHERE, (3.0, 2.0, 1.0), (0.0, 0.0, 0.0), 7.5, (True, True, True), 0.4, 1
)  # fmt: skip
PRESET = replace(  # With a hashed level, small enough to build in no time.
    DRAFT,
    name="test",
    student_grid=GridSize(4, 2, 4, 40, 1 << 12),
    student_network=MLPSize(16, 2),
    lift=0.05,
    transparency_grid=GridSize(2, 3, 4, 8, 1 << 10),
    transparency_network=MLPSize(8, 1),
    point_grid=GridSize(2, 4, 2, 6, 1 << 9),
    sampler_flow=FlowSize(2, MLPSize(16, 1), 8),
    fast_map_network=MLPSize(16, 1),
)


def wild(
    kind: Callable[[Description, Preset], nn.Module],
    description: Description = DESCRIPTION,
    preset: Preset = PRESET,
) -> Any:
    """A network with weights as large as a trained one's, so that errors show."""
    torch.manual_seed(11)
    module = kind(description, preset)
    for part in module.modules():
        if isinstance(part, GridEncoding):
            nn.init.uniform_(part.table, -1, 1)
        if isinstance(part, MLP):
            nn.init.normal_(part[-1].weight, 0, 0.5)
            nn.init.normal_(part[-1].bias, 0.5, 0.5)
    return module.eval()


def write(folder: Path) -> Path:
    """A finished run of a ball."""
    run = RunDirectory(folder)
    run.write_json(
        "config.json",
        {"luminaire": "/home/someone/lamp.xml", "digest": "0" * 64, "seed": 1, "route": "teacher",
         "preset": PRESET.to_dict()},
    )  # fmt: skip
    run.write_json("description.json", DESCRIPTION.to_dict())
    run.write_json("metrics.json", {"held_out_gain_nats": 1.5, "losses": {"student": [1.0]}})
    _write_light(run)
    for made in EXPORTED.values():
        run.save(made.trained, wild(made.module), {})
    return run.path


def _write_light(run: RunDirectory) -> None:
    """The ball's surface, and light that leaves it evenly."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=SPHERE.radius * 0.999)
    positions = (mesh.vertices + np.array(SPHERE.center)).astype(np.float32)
    flux = np.tile(np.array(DESCRIPTION.flux) / len(mesh.faces), (len(mesh.faces), 1))
    direction = np.random.default_rng(0).standard_normal((20_000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    weight = np.tile(np.array(DESCRIPTION.flux) / len(direction), (len(direction), 1))
    run.write_arrays(
        "surface.npz", positions=positions, triangles=mesh.faces.astype(np.uint32),
        triangle_flux=(0.99 * flux).astype(np.float32),
    )  # fmt: skip
    run.write_arrays("escaped.npz", direction=direction, weight=weight.astype(np.float32))
