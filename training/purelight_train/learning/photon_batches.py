"""What the route `photons` learns from: light as a viewer meets it, and rays to compare it with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.learning.thinning import Thinning
from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords, settle
from purelight_train.light.light_tracing import BATCH
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.measured_luminaire import MeasuredLuminaire

Float = NDArray[np.float32]
Chunk = tuple[Tensor, ...]
RAYS = 1 << 19
USES = 2  # of each photon, which takes as long to trace as to learn from


def seen_photons(
    records: ExitRecords, references: ReferenceRays, flux: NDArray[np.float64]
) -> tuple[Float, Float, Float, Float, Float]:
    """Position, geometric normal and direction of light as a viewer meets it, rho, and its weight.

    Returns:
        three of [N, 3]; the logarithm of the references' rho, [N]; and [N, 3] weights relative to
        the flux, so that in every channel present their sum over N is one for the light that
        escapes, and more with light that meets the lamp again.
    """
    seen, triangle = settle(records, references.chart.surface)
    scale = np.divide(len(seen) / records.paths, flux, out=np.zeros(3), where=flux > 0)
    weight = (seen.weight * scale).astype(np.float32)
    log_ratio = references.log_ratio(seen.position, seen.normal, seen.direction, triangle)
    return seen.position, seen.normal, seen.direction, log_ratio, weight


@dataclass
class Stream:
    """Batches of rows from chunks that are made when needed.

    Chunks are numbered at random from the step's own generator, so that a run that is resumed goes
    on with rows it has not seen.
    """

    make: Callable[[int], Chunk]
    chunk: Chunk = ()
    used: int = 0
    number: int = -1

    def draw(self, rng: np.random.Generator, size: int) -> Chunk:
        """The next rows of every tensor of the chunk, at most a chunk's length."""
        if not self.chunk or self.used + size > len(self.chunk[0]):
            self._next(int(rng.integers(1 << 31)))
        self.used += size
        return tuple(t[self.used - size : self.used] for t in self.chunk)

    def _next(self, number: int) -> None:
        if number != self.number:  # another trial may begin with the chunk that is at hand
            self.chunk, self.number = self.make(number), number
        self.used = 0

    def restart(self) -> None:
        """Go on with another chunk at the next draw."""
        self.used = len(self.chunk[0]) if self.chunk else 0


class PhotonBatches:
    """Endless photons and reference rays of one lamp, made while they are used."""

    def __init__(
        self,
        luminaire: Luminaire | MeasuredLuminaire,
        description: Description,
        reference_rays: ReferenceRays,
        device: torch.device,
    ) -> None:
        self.luminaire, self.device, self.reference_rays = luminaire, device, reference_rays
        self.flux, self.thinning = np.array(description.flux), Thinning(reference_rays)
        self.photons, self.references = Stream(self._photons), Stream(self._references)

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Chunk, Chunk]:
        """As many photons as reference rays: (position, normal, outgoing, log rho), and weight."""
        return self.photons.draw(rng, size), self.references.draw(rng, size)

    def restart(self) -> None:
        """Begin anew, for another network that is to see the same."""
        self.photons.restart()
        self.references.restart()

    def _photons(self, number: int) -> Chunk:
        records = self.luminaire.trace(BATCH, number)
        rng = np.random.default_rng([number, 1])
        seen = seen_photons(records, self.reference_rays, self.flux)
        columns = self.thinning.photons(seen, rng)
        count = len(columns[0])
        order = np.concatenate([rng.permutation(count) for _ in range(USES)])
        return self._tensors(*(column[order] for column in columns))

    def _references(self, number: int) -> Chunk:
        rng = np.random.default_rng(number)
        return self._tensors(*self.thinning.rays(self.reference_rays.sample(RAYS, rng), rng))

    def _tensors(self, *arrays: Float) -> Chunk:
        return tuple(torch.from_numpy(a).to(self.device) for a in arrays)
