"""What the route `photons` learns from: light as a viewer meets it, and rays to compare it with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords, settle
from purelight_train.light.exit_surface import ExitSurface, cosine_directions
from purelight_train.light.light_tracing import BATCH, trace_records
from purelight_train.light.luminaire import Luminaire

Float = NDArray[np.float32]
Chunk = tuple[Tensor, ...]
RAYS = 1 << 19


def seen_photons(
    records: ExitRecords, surface: ExitSurface, flux: NDArray[np.float64]
) -> tuple[Float, Float, Float, Float]:
    """Position, geometric normal and direction of light as a viewer meets it, and its weight.

    Returns:
        four of [N, 3]; the weights are relative to the flux, so that in every channel present their
        sum over N is one for the light that escapes, and more with light that meets the lamp again.
    """
    seen, _ = settle(records, surface)
    scale = np.divide(len(seen) / records.paths, flux, out=np.zeros(3), where=flux > 0)
    weight = (seen.weight * scale).astype(np.float32)
    return seen.position, seen.normal, seen.direction, weight


def reference_rays(
    surface: ExitSurface, count: int, rng: np.random.Generator
) -> tuple[Float, Float, Float]:
    r"""Position, normal and outgoing direction, uniform by area and projected solid angle.

    Light that meets the lamp again is among them, as it is among the photons: points under a shade
    see it. The mean of f over the pairs estimates
    :math:`\frac{1}{\pi A} \int\int f \cos\theta\,d\omega\,dA`, with A the area of both sides of
    sheets.
    """
    position, normal = surface.sample(count, rng)
    return position, normal, cosine_directions(normal, rng)


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
        """As many photons as reference rays: (position, normal, outgoing), and photons' weight."""
        return self.photons.draw(rng, size), self.references.draw(rng, size)

    def _photons(self, number: int) -> Chunk:
        surface = self.luminaire.exit_surface
        records = trace_records(self.luminaire.scene, BATCH, number, surface=surface)
        return self._shuffled(number, *seen_photons(records, surface, self.flux))

    def _references(self, number: int) -> Chunk:
        rng = np.random.default_rng(number)
        rays = reference_rays(self.luminaire.exit_surface, RAYS, rng)
        return tuple(torch.from_numpy(a).to(self.device) for a in rays)

    def _shuffled(self, number: int, *arrays: Float) -> Chunk:
        order = np.random.default_rng([number, 1]).permutation(len(arrays[0]))
        return tuple(torch.from_numpy(a[order]).to(self.device) for a in arrays)
