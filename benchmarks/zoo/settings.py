"""How much is spent on a lamp's figures."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace

from purelight_format.errors import PureLightError
from purelight_train.presets import DRAFT, PRESETS, GridSize, MLPSize, Optimisation, Preset


@dataclass(frozen=True)
class Settings:
    """The preset that trains, and the sizes of the figures.

    Arguments:
        floor_paths: light paths of the floor's own truth; `reference_paths` of Mitsuba's light
            tracer, and a sixteenth of its path tracer's.
        view_size, view_paths, view_spp: pixels a side, paths of the truth, rays of the student.
        glass_size, glass_spp: of the pictures before a bright background.
        room_size, room_paths, room_spp: of the closed room.
        patches, patch_paths, patch_spp: places inside the bounding sphere.
        sampler_points, map_points: shading points.
    """

    preset: Preset = DRAFT
    floor_paths: int = 1 << 23
    reference_paths: int = 1 << 22
    floor_spp: int = 1 << 12
    far_paths: int = 1 << 22
    view_size: int = 96
    view_paths: int = 1 << 23
    view_spp: int = 8
    glass_size: int = 64
    glass_spp: int = 128
    room_size: int = 96
    room_paths: int = 1 << 22
    room_spp: int = 64
    patches: int = 4
    patch_paths: int = 1 << 23
    patch_spp: int = 1 << 17
    sampler_points: int = 10
    map_points: int = 128

    def digest(self) -> str:
        """A word that changes with any of them."""
        text = json.dumps(asdict(self), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


TINY_PRESET = replace(
    DRAFT,
    name="tiny",
    paths=1 << 20,
    student_grid=GridSize(3, 2, 4, 16, 1 << 10),
    student_network=MLPSize(16, 2),
    transparency_samples=1 << 14,
    transparency=Optimisation(30, 1 << 10, 1e-2),
    cap_points=1 << 8,
    sampler=Optimisation(30, 1 << 10, 1e-2),
    fast_map=Optimisation(30, 1 << 5, 1e-2),
    photons=Optimisation(60, 1 << 10, 1e-2),
)
# The machinery alone: whatever comes out says nothing of the lamp
TINY = Settings(
    TINY_PRESET, floor_paths=1 << 20, reference_paths=1 << 16, floor_spp=64, far_paths=1 << 20,
    view_size=32, view_paths=1 << 16, view_spp=2, glass_size=16, glass_spp=16, room_size=16,
    room_paths=1 << 16, room_spp=8, patches=2, patch_paths=1 << 14, patch_spp=64,
    sampler_points=2, map_points=8,
)  # fmt: skip


def settings(name: str) -> Settings:
    """`tiny`, or the sizes of the zoo with a preset of the training.

    Raises:
        PureLightError: there is no such preset.
    """
    if name == "tiny":
        return TINY
    if name not in PRESETS:
        raise PureLightError(f"no preset {name}; choose from tiny {' '.join(PRESETS)}")
    return Settings(PRESETS[name])
