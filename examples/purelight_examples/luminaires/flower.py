"""Flower: layers of petals of coloured glass around a bare filament, rough or specular."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import NICKEL, RGB, TUNGSTEN, Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import COPPER, rough_glass
from purelight_examples.luminaires.parts import helix, revolve, tube
from purelight_examples.luminaires.poses import copies, joined, turn

ROSE: RGB = (0.99, 0.82, 0.86)
CUP = 0.3  # of half a petal's width, by which its sides bend inwards
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """A ring of petals; angles in degrees from straight down, at the petals' foot and tip."""

    petals: int
    length: float
    width: float
    foot: float
    tip: float
    start: float
    color: RGB = ROSE


LAYERS = (
    Layer(5, 0.1, 0.036, 8.0, 40.0, 0.024),
    Layer(5, 0.15, 0.052, 38.0, 75.0, 0.036, (0.985, 0.72, 0.78)),
    Layer(6, 0.19, 0.062, 66.0, 112.0, 0.048, (0.98, 0.62, 0.7)),
)  # fmt: skip


@dataclass(frozen=True)
class Flower(Lamp):
    """A hanging blossom after the paper's Flower; `alpha` is what makes it Rough or Specular.

    Hard for a path tracer: a coil of seven square centimetres behind layers of curved tinted glass.
    Rough petals spread its light softly; nearly smooth ones throw the sharp outline of each petal
    onto the walls, by paths that no guess finds.

    Arguments:
        alpha: roughness of the petals (GGX).
        thick: of a petal.
        grid: cells along and across a petal.
    """

    name: str = "flower_rough"
    alpha: float = 0.28
    layers: tuple[Layer, ...] = LAYERS
    thick: float = 0.003
    grid: tuple[int, int] = (20, 14)
    lumens: float = 900.0
    kelvin: float = 2800.0

    def parts(self) -> list[Part]:
        """The filament, its leads, the petals by layers, and the stem."""
        coil = tube(helix(6, 0.004, 0.03, 16), 0.0008, 8).apply_translation([0, 0, -0.055])
        light = radiance(self.lumens, self.kelvin, coil.area)
        petals = [
            Part(f"petals_{k}", self._ring(layer, k), rough_glass(self.alpha, layer.color))
            for k, layer in enumerate(self.layers)
        ]
        stem = [[0, -0.002], [0.012, -0.002], [0.05, 0.01], [0.054, 0.016], [0.03, 0.03],
                [0.012, 0.04], [0.007, 0.06], [0.007, 0.14], [0, 0.14]]  # fmt: skip
        return [
            Part("filament", coil, TUNGSTEN, light),
            Part("leads", self._leads(), NICKEL),
            *petals,
            Part("stem", revolve(solid_profile(stem), 48), COPPER),
        ]

    def _leads(self) -> trimesh.Trimesh:
        wires = [
            tube(
                [(s * 0.0175, 0, -0.059), (s * 0.0175, 0, -0.03), (s * 0.008, 0, -0.004)], 0.0007, 6
            )
            for s in (-1, 1)
        ]
        return joined(wires)

    def _ring(self, layer: Layer, number: int) -> trimesh.Trimesh:
        """The petals of a layer, turned by half a petal against the layer within."""
        step = 360 / layer.petals
        poses = [turn("z", step * (k + 0.5 * (number % 2))) for k in range(layer.petals)]
        return copies(solids.slab(self._petal(layer), self.thick), poses)

    def _petal(self, layer: Layer) -> Floats:
        """The middle of a petal that points along X: [along, across, 3]."""
        rows, columns = self.grid
        s = np.linspace(0, 1, rows + 1)
        bend = np.radians(layer.foot + (layer.tip - layer.foot) * s**1.5)
        step = layer.length / rows
        out = layer.start + step * np.concatenate(([0], np.cumsum(np.sin(bend[:-1]))))
        down = -0.008 - step * np.concatenate(([0], np.cumsum(np.cos(bend[:-1]))))
        shape = layer.width * (0.25 + 0.75 * np.sin(np.pi * s**0.8) ** 0.8)
        slope = 0.85 * np.tan(np.pi / layer.petals)
        room = slope * out / (1 + CUP * slope)  # to the next petal, whose sides bend inwards too
        half = np.minimum(shape, room) * np.sqrt(np.maximum(1 - s**6, 0.02))
        t = np.linspace(-1, 1, columns + 1)
        y = half[:, None] * t
        cup = CUP * half[:, None] * t**2  # the sides bend towards the axis
        x = out[:, None] - cup * np.cos(bend)[:, None]
        z = down[:, None] - cup * np.sin(bend)[:, None]
        return np.stack((x, y, z), -1)


def solid_profile(points: list[list[float]]) -> Floats:
    """A turned profile with its corners cut once, its ends kept on the axis."""
    p = np.asarray(points, np.float64)
    inner = p[1:-1]
    a, b = inner[:-1], inner[1:]
    cut = np.stack((0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b), 1).reshape(-1, 2)
    return np.concatenate((p[:1], inner[:1], cut, inner[-1:], p[-1:]))
