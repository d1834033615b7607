"""Rows of the report: the lamp in the square that sampler and fast map work in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from purelight_format import measures
from purelight_format.camera import orbit_axes
from purelight_format.color import LUMINANCE
from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Radiance, look
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.report.grading import heat, lamp_grade
from purelight_train.report.page import Row, Shot
from purelight_train.truth.picture import Image, means

# Shading points: azimuth, elevation in degrees, distance in radii
POINTS = ((35.0, 10.0, 1.4), (-85.0, -50.0, 2.5), (155.0, 40.0, 4.0), (90.0, -80.0, 12.0))
SIDE = 64


@dataclass(frozen=True)
class CapMaps:
    """A lamp's light, sampler and fast map at four points.

    Arguments:
        radiance: of the lamp, which the networks are to agree with.
    """

    description: Description
    surface: ExitSurface
    radiance: Radiance
    sampler: Sampler
    fast_map: FastMap

    def rows(self) -> list[Row]:
        """The rows, one column a point."""
        points = self._points()
        with torch.no_grad():
            fast = self.fast_map(torch.from_numpy(points)).numpy().astype(np.float64)
        columns = [
            self._column(at, point, told)
            for at, point, told in zip(POINTS, points, fast, strict=True)
        ]
        text = (
            "The lamp from four points, each in the square that its sampler works in: the cap of "
            "directions towards the lamp's bounding sphere, drawn as a square."
        )
        headings = {
            "Light at four points": text,
            "Where the light is": "Its luminance as a distribution.",
            "Where the sampler looks": "Its density on the same scale, and what part of it and of "
            "the light above are the same.",
            "What a fast map should be": "Means of the light over 16 x 16 cells.",
            "What the fast map is": "Same exposure. What lights a matt surface is the sum of the "
            "cells; light in other cells than it should be in shows where shadows end and in "
            "reflections.",
        }
        rows = zip(headings.items(), zip(*columns, strict=True), strict=True)
        return [Row(heading, words, shots) for (heading, words), shots in rows]

    def _column(
        self, at: tuple[float, float, float], point: NDArray[np.float32], fast: Image
    ) -> list[Shot]:
        """One point's pictures, from top to bottom."""
        light, density = self._light(point), self._density(point)
        grade, share = (
            lamp_grade(self.description.flux, light.reshape(-1, 3), 97),
            light @ LUMINANCE,
        )
        share /= max(share.mean(), 1e-300)
        white = float(np.percentile(share, 99)) or 1.0
        cells, side = means(light, SIDE // len(fast)), SIDE // len(fast)
        level = max(cells.mean(), 1e-300)
        figures = {
            "light": f"{100 * (fast.mean() / level - 1):+.0f} %",
            "in other cells": f"{50 * np.abs(fast - cells).mean() / level:.0f} %",
        }
        common = np.minimum(density / density.mean(), share).mean()
        large = np.ones((side, side, 1))
        return [
            Shot("{2:g} radii away, {0:g}°, {1:g}°".format(*at), grade.uri(light)),
            Shot("Light", heat(share, white)),
            Shot(f"Sampler: {100 * common:.0f} % the same", heat(density, white)),
            Shot("Light in cells", grade.uri(np.kron(cells, large))),
            Shot("Fast map", grade.uri(np.kron(fast, large)), figures),
        ]

    def _points(self) -> NDArray[np.float32]:
        sphere = self.description.sphere
        offset = [distance * orbit_axes(a, e)[2] for a, e, distance in POINTS]
        return (np.asarray(sphere.center) + sphere.radius * np.array(offset)).astype(np.float32)

    def _square(self, rng: np.random.Generator | None = None) -> NDArray[np.float64]:
        """Coordinates in each of SIDE x SIDE cells, their centres or random: [SIDE², 2]."""
        corner = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), -1).reshape(-1, 2)
        shift = 0.5 if rng is None else rng.random(corner.shape)
        result: NDArray[np.float64] = (corner + shift) / SIDE
        return result

    def _light(self, point: NDArray[np.float32], samples: int = 4) -> Image:
        """Radiance over the cap's square: [SIDE, SIDE, 3]."""
        rng = np.random.default_rng(7)
        here = np.repeat(point[None], SIDE * SIDE, 0)
        cap = measures.cap(here.astype(np.float64), self.description.sphere)
        total = np.zeros((SIDE * SIDE, 3))
        for _ in range(samples):
            toward = measures.cap_to_direction(self._square(rng), cap).astype(np.float32)
            total += look(self.surface, self.radiance, here, toward) / samples
        return total.reshape(SIDE, SIDE, 3)

    def _density(self, point: NDArray[np.float32]) -> Image:
        """The sampler's density over the cap's square, of mean one: [SIDE, SIDE]."""
        here = np.repeat(point[None], SIDE * SIDE, 0)
        cap = measures.cap(here.astype(np.float64), self.description.sphere)
        toward = measures.cap_to_direction(self._square(), cap).astype(np.float32)
        with torch.no_grad():
            pdf = self.sampler.pdf_solid_angle(
                torch.from_numpy(here), torch.from_numpy(toward)
            ).numpy()
        density: Image = (pdf * cap.solid_angle).astype(np.float64).reshape(SIDE, SIDE)
        return density
