"""One lamp and all that its figures are made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from benchmarks.zoo.figures.enlarged import Enlarged
from benchmarks.zoo.lamps.lamp import Lamp
from benchmarks.zoo.settings import Settings
from purelight_format.measures import BoundingSphere
from purelight_train.truth.plane import Plane
from tests.support.fidelity import Subject

SETTLED = 0.02  # relative standard error of a mean from which on it says nothing


@dataclass(frozen=True)
class Case:
    """A lamp, what was trained of it, the real one enlarged, and what may be spent."""

    lamp: Lamp
    subject: Subject
    large: Enlarged
    settings: Settings

    @cached_property
    def sphere(self) -> BoundingSphere:
        """The lamp's own bounding sphere."""
        return self.subject.description.sphere

    @cached_property
    def large_sphere(self) -> BoundingSphere:
        return self.large.sphere(self.sphere)

    def plane(self, distance: float, side: float, cells: int) -> Plane:
        """A plane below the lamp, lengths in radii."""
        x, y, z = self.sphere.center
        radius = self.sphere.radius
        return Plane((x, y, z - distance * radius), side * radius, cells)

    def ours(self, mode: str, **lamp: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """The bundle in the enlarged scene, and its integrator for light that bounces once."""
        integrator = {"type": "purelight", "mode": mode, "max_depth": 2}
        return self.large.instance(self.subject.bundle, **lamp), integrator
