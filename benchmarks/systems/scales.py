"""How much is spent: lamps, training, sizes of pictures, samples, light paths of the truth."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.systems.tasks.floor import Floor
from benchmarks.systems.tasks.glare import Glare
from benchmarks.systems.tasks.instances import Instances
from benchmarks.systems.tasks.room import Room
from benchmarks.systems.tasks.roughness import Roughness
from benchmarks.systems.tasks.task import JudgedTask
from benchmarks.systems.tasks.views import View
from purelight_examples.luminaires.catalog import CATALOG
from purelight_format.errors import PureLightError

VIEWS = {"view_side": (35.0, 10.0), "view_below": (-85.0, -50.0), "view_above": (155.0, 40.0)}
GALLERY = "view_gallery"  # from where the gallery looks: a downlight is dark from the side
ANY_LAMP = next(iter(CATALOG))  # tasks of all lamps have the same names, kinds and sizes
OBSERVERS = {"glare_near": (-60.0, -35.0, 8.0), "glare_far": (-60.0, -15.0, 16.0)}


@dataclass(frozen=True)
class Scale:
    """What one call of the benchmark measures.

    Arguments:
        lamps: of the gallery; `preset` of their training (`tiny`, `sketch` or purelight-train's).
        size, view_size, glare_size: pixels a side; `floor_pixels`: of a cell of the grid. That of
            glare is the same at all scales: a rating depends on how fine its sources are.
        samples: per pixel, of a series; each twice the one before, up to more than any system can
            draw within the limit.
        paths, view_paths: light paths of the truths.
        views: some of `VIEWS`, or `GALLERY`; `observers`: some of `OBSERVERS`.
        instances: counts of lamps.
        limit: seconds of rendering that no series passes, and where it ends: whoever is quick draws
            more samples.
        systems: by name; all if None.
    """

    name: str
    lamps: tuple[str, ...]
    preset: str
    size: int
    view_size: int
    glare_size: int
    floor_pixels: int
    samples: tuple[int, ...]
    paths: int
    view_paths: int
    views: tuple[str, ...]
    observers: tuple[str, ...]
    instances: tuple[int, ...]
    limit: float
    systems: tuple[str, ...] | None = None

    def tasks(self, lamp: str, aperture: float) -> list[JudgedTask]:
        """All tasks of a lamp of the gallery; `aperture` of the lenses, over their distance."""
        seen = VIEWS | {GALLERY: (CATALOG[lamp].azimuth, CATALOG[lamp].elevation)}
        views = [View(n, *seen[n], self.view_size, aperture) for n in self.views]
        eyes = [
            Glare(n, *OBSERVERS[n][:2], self.glare_size, aperture, OBSERVERS[n][2])
            for n in self.observers
        ]
        halls = [Instances(count, self.size) for count in self.instances]
        lit = [Room(self.size), Floor(self.floor_pixels), Roughness(self.size)]
        return [*lit, *views, *eyes, *halls]

    def paths_of(self, task: JudgedTask) -> int:
        """Light paths of a task's truth."""
        return self.view_paths if task.kind == "appearance" else self.paths


def doubling(most: int) -> tuple[int, ...]:
    """Powers of two up to the last: 1, 2, 4, ..."""
    return tuple(1 << k for k in range(most.bit_length()))


SCALES = {
    "smoke": Scale(
        "smoke", ("frosted_globe",), "tiny", 24, 24, 24, 2, doubling(8), 1 << 19, 1 << 20,
        ("view_side",), ("glare_near",), (1, 4), 1,
        ("path", "ptracer", "purelight_accurate", "purelight_fast", "ies", "rays_1m",
         "bidirectional"),
    ),
    "small": Scale(
        "small", tuple(CATALOG), "sketch", 48, 48, 24, 2,
        doubling(1 << 24), 1 << 22, 1 << 27, (GALLERY,), ("glare_near",), (1, 16), 4,
    ),
    "full": Scale(
        "full", tuple(CATALOG), "standard", 128, 128, 24, 8,
        doubling(1 << 30), 1 << 28, 1 << 28, tuple(VIEWS),
        tuple(OBSERVERS), (1, 16, 256), 300,
    ),
}  # fmt: skip


def scale(name: str) -> Scale:
    """A scale by name.

    Raises:
        PureLightError: there is no such scale.
    """
    if name not in SCALES:
        raise PureLightError(f"no scale {name}; choose from {' '.join(SCALES)}")
    return SCALES[name]
