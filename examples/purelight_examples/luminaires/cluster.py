"""Cluster: globes in globes on a brass tree, a filament in each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import BRASS, Part
from purelight_examples.luminaires.materials import glass
from purelight_examples.luminaires.parts import globe_profile, revolve, shell, tube
from purelight_examples.luminaires.poses import Floats, copies, joined, shift, turn

GAP = 0.0015
SMOKED = glass(tint=(0.97, 0.9, 0.8))


@dataclass(frozen=True)
class Cluster(Lamp):
    """A pendant of many lobes, after the paper's Cluster, 0.4 m across.

    Hard for a path tracer: each filament is a few square millimetres behind four interfaces of
    two glass walls, and there is one in each of seven lobes, so that no guess leads to it.

    Arguments:
        lobes: around the one in the middle.
        reach: from the axis to the lobes' centres.
        globe: radius of the outer glass; its wall is `wall` thick.
        drop: by which every other lobe, and then the middle one, hangs lower.
        lumens: of each filament.
    """

    name: str = "cluster"
    lobes: int = 6
    reach: float = 0.125
    globe: float = 0.055
    wall: float = 0.002
    drop: float = 0.05
    lumens: float = 420.0
    kelvin: float = 2700.0
    bulb: Bulb = field(default_factory=lambda: Bulb(sections=20, steps=12))

    def parts(self) -> list[Part]:
        """Bulbs, their outer globes, and the tree that carries them."""
        poses = self._poses()
        return [
            *self.bulb.parts(poses, self.lumens, self.kelvin, BRASS),
            Part("globes", copies(self._globe(), poses), SMOKED),
            Part("holders", copies(self._holder(), poses), BRASS),
            Part("tree", self._tree(poses), BRASS),
        ]

    def _poses(self) -> list[Floats]:
        """Of the lobes: in a ring at two heights, and one below in the middle."""
        step = 360.0 / self.lobes
        ring = [
            turn("z", step * k) @ shift(self.reach, 0.0, -self.drop * (k % 2))
            for k in range(self.lobes)
        ]
        return [*ring, shift(z=-2.2 * self.drop)]

    @property
    def _mouth(self) -> float:
        """Radius of the outer globe's neck, wide enough for the socket."""
        return self.bulb.outer + self.wall + 3 * GAP

    @property
    def _top(self) -> float:
        return self.bulb.top + self.wall + 0.006

    def _globe(self) -> trimesh.Trimesh:
        profile = globe_profile(self.globe, self._mouth, self._top, 22)
        return shell(profile, self.wall, 44)

    def _holder(self) -> trimesh.Trimesh:
        """A cap over the outer globe's neck."""
        inner, low, top = self._mouth + GAP, self._top - 0.008, self._top + GAP
        profile = [
            [0, top],
            [inner, top],
            [inner, low],
            [inner + 0.002, low],
            [inner + 0.002, top + 0.002],
            [0.4 * inner, top + 0.012],
            [0, top + 0.012],
        ]
        return revolve(profile, 32)  # fmt: skip

    def _tree(self, poses: list[Floats]) -> trimesh.Trimesh:
        """A rod to each lobe from a turned hub on a stem."""
        high = 0.17
        hub = [
            [0, high - 0.02],
            [0.012, high - 0.016],
            [0.026, high],
            [0.026, high + 0.012],
            [0.01, high + 0.028],
            [0.006, high + 0.05],
            [0.006, high + 0.12],
            [0, high + 0.12],
        ]
        rods = [self._rod(pose, high) for pose in poses]  # fmt: skip
        return joined([revolve(hub, 40), *rods])

    def _rod(self, pose: Floats, high: float) -> trimesh.Trimesh:
        foot = pose[:3, 3] + (0, 0, self._top + 0.012 + 2 * GAP)
        out = pose[:3, 3] * (1, 1, 0)
        length = float(np.linalg.norm(out))
        if length == 0:
            rise = high - 0.022 - foot[2]
            return tube(foot + np.outer([0, 0.5, 1], (0, 0, rise)), 0.003, 8)
        start = out / length * 0.03 + (0, 0, high + 0.006)
        t = np.linspace(0, 1, 9)[:, None]
        corner = out + np.array((0, 0, high + 0.006))
        path = (1 - t) ** 2 * foot + 2 * t * (1 - t) * corner + t**2 * start
        return tube(path, 0.003, 8)
