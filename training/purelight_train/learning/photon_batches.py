"""What the route `photons` learns from: light as a viewer meets it, and rays to compare it with."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface, inward_rays
from purelight_train.light.light_tracing import BATCH, trace_records
from purelight_train.light.luminaire import Luminaire

Float = NDArray[np.float32]
Chunk = tuple[Tensor, ...]
LINES = 1 << 20


def seen_photons(
    records: ExitRecords, surface: ExitSurface, flux: NDArray[np.float64]
) -> tuple[Float, Float, Float, Float]:
    """Records by position, geometric normal and direction as a viewer meets them, and weight.

    Those that a viewer meets elsewhere (shapes are tessellated) are left out.

    Returns:
        four of [N, 3]; the weights are relative to the flux, so that their mean is one in every
        channel present, but for what was left out.
    """
    reach = 3 * surface.sphere.radius
    hits = surface.intersect(records.position + reach * records.direction, -records.direction)
    distance = np.linalg.norm(hits.position - records.position[hits.index], axis=1)
    near = distance < 1e-2 * surface.sphere.radius
    index = hits.index[near]
    scale = np.divide(len(index) / records.paths, flux, out=np.zeros(3), where=flux > 0)
    weight = (records.weight[index] * scale).astype(np.float32)
    return hits.position[near], hits.normal[near], records.direction[index], weight


def reference_rays(
    surface: ExitSurface, lines: int, rng: np.random.Generator
) -> tuple[Float, Float, Float, float]:
    r"""Pairs (position, outgoing) uniform by area and projected solid angle.

    They are where uniform lines through the bounding sphere first meet the lamp, so that pairs
    whose light would meet the lamp again never occur.

    Returns:
        position, normal, outgoing, each [N, 3]; and their whole measure over :math:`\pi A`, which
        is one for a convex lamp: the mean of f over the pairs, times it, estimates
        :math:`\frac{1}{\pi A} \int\int f \cos\theta\,d\omega\,dA` without bias.
    """
    origin, direction = inward_rays(surface.sphere, lines, rng, cosine=True)
    hits = surface.intersect(origin, direction)
    radius = 1.0001 * surface.sphere.radius  # where `inward_rays` start
    measure = len(hits.index) / lines * 4 * math.pi * radius**2 / surface.area
    return hits.position, hits.normal, -direction[hits.index], measure


@dataclass
class Stream:
    """Batches of rows from chunks that are made when needed; every row is drawn once.

    Chunks are numbered at random from the step's own generator, so that a run that is resumed goes
    on with rows it has not seen.
    """

    make: Callable[[int], Chunk]
    chunk: Chunk = ()
    used: int = 0

    def draw(self, rng: np.random.Generator, size: int) -> Chunk:
        """The next rows of every tensor of the chunk, at most a chunk's length."""
        if not self.chunk or self.used + size > len(self.chunk[0]):
            self.chunk, self.used = self.make(int(rng.integers(1 << 31))), 0
        self.used += size
        return tuple(t[self.used - size : self.used] for t in self.chunk)


class PhotonBatches:
    """Endless photons and reference rays of one lamp, made while they are used."""

    def __init__(
        self, luminaire: Luminaire, description: Description, device: torch.device
    ) -> None:
        self.luminaire, self.device = luminaire, device
        self.flux = np.array(description.flux)
        self.photons, self.references = Stream(self._photons), Stream(self._references)

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Chunk, Chunk]:
        """As many photons as reference rays: (position, normal, outgoing, weight or measure)."""
        return self.photons.draw(rng, size), self.references.draw(rng, size)

    def _photons(self, number: int) -> Chunk:
        records = trace_records(self.luminaire.scene, BATCH, number)
        return self._shuffled(
            number, *seen_photons(records, self.luminaire.exit_surface, self.flux)
        )

    def _references(self, number: int) -> Chunk:
        rng = np.random.default_rng(number)
        *rays, measure = reference_rays(self.luminaire.exit_surface, LINES, rng)
        return self._shuffled(number, *rays, np.full((len(rays[0]), 1), measure, np.float32))

    def _shuffled(self, number: int, *arrays: Float) -> Chunk:
        order = np.random.default_rng([number, 1]).permutation(len(arrays[0]))
        return tuple(torch.from_numpy(a[order]).to(self.device) for a in arrays)
