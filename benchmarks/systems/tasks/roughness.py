"""Bias against roughness: a floor of metal strips below the lamp, from polished to matt."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.past_lamp import past_lamp
from benchmarks.systems.protocol import Subject
from benchmarks.systems.tasks import placing
from benchmarks.systems.tasks.task import Figures, JudgedTask
from benchmarks.systems.tasks.truth import Mask, Truth
from purelight_examples.luminaires.lamp_scene import Material, Part
from purelight_examples.scenes.furniture import wall
from purelight_examples.scenes.lamp_choice import LampChoice, RealLamp
from purelight_train.truth.picture import Picture

ALPHAS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
BELOW, WIDE, LONG = 4.0, 9.0, 16.0  # of the floor, in radii
EYE, AIM, FOV = (0.0, -13.0, 4.0), (0.0, 0.0, -4.0), 36.0


@dataclass(frozen=True)
class Roughness(JudgedTask):
    """Strips that lead from the camera to below the lamp, whose mirror image lies across them.

    What is judged are the strips: the lamp itself is at the upper edge of the picture.

    Arguments:
        size: pixels a side of the picture.
    """

    size: int
    name: str = "roughness"
    kind: str = "illumination"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """Lengths are in radii of the lamp."""
        unit = placing.sphere(subject, lamp).radius
        sensor = placing.pinhole((self.size, self.size), EYE, AIM, FOV, unit)
        lamps = placing.elements(subject, lamp, folder)
        return placing.write(
            folder, self.name, placing.in_the_open(lamp), sensor, strips(unit), lamps
        )

    def mask(self, subject: Subject, scene: Any) -> Mask:
        """The strips, but where the lamp is in front of them."""
        about = placing.sphere(subject, RealLamp(subject.scene))
        return (self.strips() >= 0) & past_lamp(scene.sensors()[0], about, placing.CLEAR)

    def figures(self, subject: Subject, picture: Picture, truth: Truth) -> Figures:
        """By strip: relative error of its mean radiance, and that mean's standard error.

        The latter is of both pictures together, the channels of a pixel taken to vary together.
        """
        rows: Figures = {"alpha": list(ALPHAS), "bias": [], "bias_noise": []}
        strip = self.strips()
        for index in range(len(ALPHAS)):
            own = (strip == index) & truth.mask
            true = float(truth.picture.image[own].mean())
            error = [np.sqrt((p.error[own].sum(-1) ** 2).sum()) / p.error[own].size
                     for p in (picture, truth.picture)]  # fmt: skip
            lit = true > 0
            rows["bias"].append(float(picture.image[own].mean() / true - 1) if lit else None)
            rows["bias_noise"].append(float(np.hypot(*error) / true) if lit else None)
        return rows

    def strips(self) -> np.ndarray:
        """The strip that each pixel sees, [size, size], or -1."""
        eye, aim = np.array(EYE), np.array(AIM)
        ahead = (aim - eye) / np.linalg.norm(aim - eye)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        half = np.tan(np.radians(FOV / 2))
        middle = (np.arange(self.size) + 0.5) / self.size * 2 - 1
        x, y = np.meshgrid(middle, -middle)
        ray = ahead + half * (x[..., None] * right + y[..., None] * up)
        with np.errstate(divide="ignore"):
            along = (-BELOW - eye[2]) / ray[..., 2]
        at = eye + along[..., None] * ray
        inside = (along > 0) & (np.abs(at[..., 1]) < LONG / 2) & (np.abs(at[..., 0]) < WIDE / 2)
        number = np.floor((at[..., 0] / WIDE + 0.5) * len(ALPHAS))
        return np.where(inside, number, -1).astype(int)


def strips(unit: float) -> list[Part]:
    """The floor's strips, side by side along X, grey metal of growing roughness.

    Arguments:
        unit: in m.
    """
    step = WIDE / len(ALPHAS)
    made = []
    for index, alpha in enumerate(ALPHAS):
        x = (index + 0.5) * step - WIDE / 2
        mesh = wall((x * unit, 0, -BELOW * unit), 3, (0.5 * step * unit, 0.5 * LONG * unit))
        metal = Material(
            "roughconductor", {"material": "none", "distribution": "ggx", "alpha": alpha},
            {"specular_reflectance": (0.8, 0.8, 0.8)},
        )  # fmt: skip
        made.append(Part(f"strip{index}", mesh, metal))
    return made
