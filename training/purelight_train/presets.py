"""Presets: the sizes and counts of a training run, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from purelight_format.errors import PureLightError

ANCHORS: dict[str, tuple[str, ...]] = {
    "none": (),
    "straight": ("straight",),
    "refracted": ("refracted",),
    "both": ("straight", "refracted"),
}


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
    """Everything that differs between draft, standard and paper, and between the routes.

    Arguments:
        paths: emitted paths whose records are kept: for flux, photon map and, unless
            `fresh_records`, for all training.
        density_neighbours: photons that the photon map's radius is to hold on average.
        fresh_records: generate records during optimisation, each used once, as the paper does.
        cap_points: shading points that sampler and fast map learn from; with too few of them a
            small bright filament is learned by heart.
        transparency_samples: lines through the lamp; with too few of them their noise is learned.
        transparency_anchor: whether the transparency encodes the anchor `straight` too, over a grid
            like that of the point.
        fast_map_one_hot: evaluate the fast map's network channel by channel (`fast_map`).
        photons: optimisation of the student on the route `photons`; its batch counts photons.
        photon_loss: `both`, `logistic` or `poisson` (`photon_loss`).
        reference_ratio: weight of the reference rays against the photons, for `logistic`.
        reference_light: part of the reference rays that is drawn where the light is.
        anchor: which anchors of the ray the student encodes besides the point, one of `ANCHORS`
            (`surface_network`).
        anchor_grid: grid over each of them.
        lift: where the student's grid looks a point up, in radii of the bounding sphere above the
            surface, so that the two sides of a thin shade are two places (`surface_network`).
        student_link: `log1p` or `log` (`student`).
        tolerance: most that the exit surface is moved to have fewer triangles, over the radius of
            its bounding sphere; 0 leaves it as it is (`decimation`).
        mixed_precision: dense layers are trained in bfloat16 (`encodings.MLP`).
        The others are sizes, samples and steps of the networks they are named after.
    """

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
    fast_map_one_hot: bool
    photons: Optimisation
    photon_loss: str = "both"
    reference_ratio: float = 1.0
    reference_light: float = 0.5
    fresh_records: bool = False
    anchor: str = "none"
    anchor_grid: GridSize | None = None
    lift: float = 0.0
    student_link: str = "log1p"
    transparency_anchor: bool = False
    mixed_precision: bool = False
    tolerance: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """A JSON-ready form of the preset."""
        return asdict(self)

    def with_steps(self, change: Callable[[int], int]) -> Preset:
        """The preset with other numbers of steps of each optimisation."""
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        other: dict[str, Any] = {
            name: replace(part, steps=change(part.steps))
            for name, part in parts.items()
            if isinstance(part, Optimisation)
        }
        return replace(self, **other)

    @staticmethod
    def from_dict(data: dict[str, Any]) -> Preset:
        """Inverse of `to_dict`.

        Raises:
            PureLightError: the preset was written by another version.
        """
        try:
            return Preset(**{key: _part(key, value) for key, value in data.items()})
        except TypeError:
            raise PureLightError("the run was made by another version; train again") from None

    @property
    def anchors(self) -> dict[str, GridSize]:
        """The anchors that the student encodes, and the grid over each."""
        return (
            {}
            if self.anchor_grid is None
            else dict.fromkeys(ANCHORS[self.anchor], self.anchor_grid)
        )

    @property
    def transparency_anchors(self) -> dict[str, GridSize]:
        """The anchors that the transparency encodes, and the grid over each."""
        return {"straight": self.transparency_grid} if self.transparency_anchor else {}

    @property
    def transparency_grids(self) -> list[GridSize]:
        """All grids of the transparency."""
        return [self.transparency_grid, *self.transparency_anchors.values()]

    def for_route(self, route: str, *, anchor: str = "none") -> Preset:
        """The preset of a route; anchors take their grids out of the student's, size for size.

        The route `photons` traces what it learns from while it learns, and keeps few records.
        """
        preset = self
        if route == "photons":
            preset = replace(self, student_link="log", paths=self.paths // 4)
        if not ANCHORS[anchor]:
            return preset
        half = half_grid(self.student_grid)
        grid = half if len(ANCHORS[anchor]) == 1 else half_grid(half)
        return replace(preset, student_grid=half, anchor=anchor, anchor_grid=grid)


def half_grid(grid: GridSize) -> GridSize:
    """A grid of about half the size: five eighths of the levels, up to half the resolution."""
    levels = max(2, round(grid.levels * 5 / 8))
    return replace(grid, levels=levels, finest=max(grid.base, grid.finest // 2))


def _part(key: str, value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if key.endswith("grid"):
        return GridSize(**value)
    if key.endswith("network"):
        return MLPSize(**value)
    if key.endswith("flow"):
        return FlowSize(value["couplings"], MLPSize(**value["network"]), value["bins"])
    return Optimisation(**value)


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
    transparency_samples=1 << 22,
    transparency_grid=GridSize(4, 2, 8, 32, 1 << 14),
    transparency_anchor=True,
    transparency_network=MLPSize(32, 2),
    transparency=Optimisation(800, 1 << 14, 5e-3),
    cap_points=1 << 16,
    point_grid=GridSize(3, 4, 4, 16, 1 << 13),
    sampler_flow=FlowSize(2, MLPSize(32, 2), 16),
    sampler=Optimisation(2000, 1 << 11, 2e-2),
    fast_map_network=MLPSize(32, 3),
    fast_map=Optimisation(4000, 1 << 8, 1e-2),
    fast_map_one_hot=False,
    photons=Optimisation(3000, 1 << 11, 1e-2),
    tolerance=5e-4,
)

# Whether a lamp goes through at all; its light is about right, its look is not
SKETCH = replace(
    DRAFT,
    name="sketch",
    paths=2 << 20,
    teacher_grid=GridSize(3, 4, 4, 16, 1 << 12),
    teacher_flow=FlowSize(2, MLPSize(32, 2), 8),
    teacher=Optimisation(150, 1 << 12, 8e-3),
    distillation_samples=1 << 18,
    student_grid=GridSize(4, 4, 4, 32, 1 << 13),
    lift=0.06,  # about a cell of the finest level
    student_network=MLPSize(32, 2),
    student=Optimisation(300, 1 << 13, 8e-3),
    transparency_samples=1 << 19,
    transparency_grid=GridSize(3, 2, 8, 16, 1 << 12),
    transparency_network=MLPSize(16, 2),
    transparency=Optimisation(150, 1 << 12, 8e-3),
    cap_points=1 << 12,
    point_grid=GridSize(3, 4, 4, 16, 1 << 11),
    sampler_flow=FlowSize(2, MLPSize(16, 2), 8),
    sampler=Optimisation(150, 1 << 11, 8e-3),
    fast_map_network=MLPSize(16, 2),
    fast_map=Optimisation(200, 1 << 7, 1e-2),
    photons=Optimisation(300, 1 << 11, 1e-2),
)

STANDARD = Preset(
    name="standard",
    paths=24 << 20,
    density_neighbours=400,
    teacher_grid=GridSize(8, 4, 8, 256, 1 << 16),
    teacher_flow=FlowSize(4, MLPSize(96, 2), 24),
    teacher=Optimisation(3000, 1 << 13, 4e-3),
    distillation_samples=1 << 23,
    student_grid=GridSize(10, 4, 8, 512, 1 << 17),
    student_network=MLPSize(128, 4),
    student=Optimisation(10_000, 1 << 13, 5e-3),
    transparency_samples=1 << 24,
    transparency_grid=GridSize(5, 2, 8, 64, 1 << 16),
    transparency_anchor=True,
    transparency_network=MLPSize(64, 3),
    transparency=Optimisation(2000, 1 << 14, 3e-3),
    cap_points=1 << 18,
    point_grid=GridSize(4, 4, 4, 32, 1 << 16),
    sampler_flow=FlowSize(2, MLPSize(48, 2), 24),
    sampler=Optimisation(4000, 1 << 12, 1e-2),
    fast_map_network=MLPSize(64, 3),
    fast_map=Optimisation(6000, 1 << 8, 5e-3),
    fast_map_one_hot=False,
    photons=Optimisation(20_000, 1 << 12, 1e-2),
    tolerance=3e-4,
)

PAPER = Preset(
    name="paper",
    paths=32 << 20,
    density_neighbours=1000,
    teacher_grid=GridSize(16, 2, 16, 2048, 1 << 20),
    teacher_flow=FlowSize(8, MLPSize(256, 5), 32),
    teacher=Optimisation(100_000, 1 << 17, 1e-3),
    distillation_samples=1 << 26,
    student_grid=GridSize(16, 2, 16, 2048, 1 << 20),
    student_network=MLPSize(512, 5),
    student=Optimisation(100_000, 1 << 17, 1e-3),
    transparency_samples=1 << 24,
    transparency_grid=GridSize(16, 2, 16, 512, 1 << 20),
    transparency_network=MLPSize(128, 5),
    transparency=Optimisation(50_000, 1 << 17, 1e-3),
    cap_points=1 << 18,
    point_grid=GridSize(4, 4, 8, 176, 1 << 23),
    sampler_flow=FlowSize(4, MLPSize(128, 5), 32),
    sampler=Optimisation(100_000, 1 << 17, 1e-3),
    fast_map_network=MLPSize(512, 5),
    fast_map=Optimisation(50_000, 1 << 10, 1e-3),
    fast_map_one_hot=True,
    photons=Optimisation(50_000, 1 << 15, 5e-3),
    fresh_records=True,
    tolerance=2e-4,
)

PRESETS = {preset.name: preset for preset in (SKETCH, DRAFT, STANDARD, PAPER)}
