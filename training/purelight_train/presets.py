"""Presets: the sizes and counts of a training run, and nothing else."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class GridSize:
    """A multi-resolution grid (`encodings.GridEncoding`)."""

    levels: int
    features: int
    base: int
    finest: int
    table_size: int


@dataclass(frozen=True)
class MLPSize:
    """Hidden layers of a network."""

    width: int
    depth: int


@dataclass(frozen=True)
class FlowSize:
    """A coupling flow: layers, the network of each, and bins per spline."""

    couplings: int
    network: MLPSize
    bins: int


@dataclass(frozen=True)
class Optimisation:
    """Steps of Adam with a batch and a peak learning rate that decays by a cosine."""

    steps: int
    batch: int
    learning_rate: float


@dataclass(frozen=True)
class Preset:
    """Everything that differs between draft, standard and paper."""

    name: str
    paths: int
    density_neighbours: int
    teacher_grid: GridSize
    teacher_flow: FlowSize
    teacher: Optimisation
    distillation_samples: int
    student_grid: GridSize
    student_network: MLPSize
    student: Optimisation
    transparency_samples: int
    transparency_grid: GridSize
    transparency_network: MLPSize
    transparency: Optimisation
    cap_points: int
    point_grid: GridSize
    sampler_flow: FlowSize
    sampler: Optimisation
    fast_map_network: MLPSize
    fast_map: Optimisation

    def to_dict(self) -> dict[str, Any]:
        """A JSON-ready form of the preset."""
        return asdict(self)


DRAFT = Preset(
    name="draft",
    paths=6 << 20,
    density_neighbours=800,
    teacher_grid=GridSize(4, 4, 4, 32, 1 << 15),
    teacher_flow=FlowSize(4, MLPSize(64, 2), 16),
    teacher=Optimisation(700, 1 << 13, 4e-3),
    distillation_samples=1 << 21,
    student_grid=GridSize(8, 4, 8, 128, 1 << 15),
    student_network=MLPSize(64, 3),
    student=Optimisation(2000, 1 << 14, 5e-3),
    transparency_samples=1 << 20,
    transparency_grid=GridSize(6, 2, 8, 64, 1 << 14),
    transparency_network=MLPSize(32, 2),
    transparency=Optimisation(800, 1 << 14, 5e-3),
    cap_points=1 << 14,
    point_grid=GridSize(3, 4, 4, 16, 1 << 13),
    sampler_flow=FlowSize(2, MLPSize(32, 2), 16),
    sampler=Optimisation(800, 1 << 14, 4e-3),
    fast_map_network=MLPSize(32, 3),
    fast_map=Optimisation(2000, 1 << 8, 3e-3),
)

STANDARD = Preset(
    name="standard",
    paths=48 << 20,
    density_neighbours=600,
    teacher_grid=GridSize(10, 4, 8, 256, 1 << 17),
    teacher_flow=FlowSize(6, MLPSize(128, 3), 32),
    teacher=Optimisation(6000, 1 << 14, 3e-3),
    distillation_samples=1 << 24,
    student_grid=GridSize(10, 4, 8, 256, 1 << 17),
    student_network=MLPSize(128, 4),
    student=Optimisation(12_000, 1 << 14, 3e-3),
    transparency_samples=1 << 22,
    transparency_grid=GridSize(8, 2, 8, 128, 1 << 16),
    transparency_network=MLPSize(64, 3),
    transparency=Optimisation(4000, 1 << 14, 3e-3),
    cap_points=1 << 16,
    point_grid=GridSize(4, 4, 4, 32, 1 << 16),
    sampler_flow=FlowSize(4, MLPSize(64, 3), 32),
    sampler=Optimisation(6000, 1 << 14, 3e-3),
    fast_map_network=MLPSize(128, 4),
    fast_map=Optimisation(6000, 1 << 7, 2e-3),
)

PAPER = Preset(
    name="paper",
    paths=256 << 20,
    density_neighbours=1000,
    teacher_grid=GridSize(16, 2, 16, 2048, 1 << 20),
    teacher_flow=FlowSize(8, MLPSize(256, 5), 32),
    teacher=Optimisation(100_000, 1 << 17, 1e-3),
    distillation_samples=1 << 26,
    student_grid=GridSize(16, 2, 16, 2048, 1 << 18),
    student_network=MLPSize(512, 5),
    student=Optimisation(100_000, 1 << 17, 1e-3),
    transparency_samples=1 << 24,
    transparency_grid=GridSize(16, 2, 16, 2048, 1 << 18),
    transparency_network=MLPSize(128, 5),
    transparency=Optimisation(50_000, 1 << 17, 1e-3),
    cap_points=1 << 18,
    point_grid=GridSize(4, 4, 8, 64, 1 << 19),
    sampler_flow=FlowSize(4, MLPSize(128, 5), 32),
    sampler=Optimisation(100_000, 1 << 17, 1e-3),
    fast_map_network=MLPSize(512, 5),
    fast_map=Optimisation(50_000, 1 << 10, 1e-3),
)

PRESETS = {preset.name: preset for preset in (DRAFT, STANDARD, PAPER)}
