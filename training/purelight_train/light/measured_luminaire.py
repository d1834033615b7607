"""A luminaire of which nothing is known but the rays of its light."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.files import read_ray_file
from purelight_format.ray_file.rays import Rays
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.virtual_surface import (
    AUTO,
    START,
    TIGHT,
    read_surface,
    virtual_surface,
)
from purelight_train.light.visible_part import visible_part

HELD_OUT_SHARE, LEAST_RAYS, MOST_RAYS = 0.1, 1000, 1 << 23
SCARCE = 2  # Times that a ray is shown before a network may learn it by heart.
BESIDE = 0.02  # Of the power that may pass beside a given surface.
VISIBILITY_RAYS = 1 << 21
DIGEST_CHUNK = 1 << 22


@dataclass(frozen=True)
class MeasuredLuminaire:
    """Rays on an exit surface that is given or laid around them.

    What `luminaire.Luminaire` tells of a lamp's scene, this tells of measured rays: light comes
    from a finite stock, of which a tenth is kept from training. What is seen through the lamp, and
    what its surface is made of, is not known.

    Arguments:
        path: of the ray file.
        rays: all of them, those that meet the surface.
        exit_surface: where they leave.
        surface_kind: how that surface came about, in a word.
        seed: of the choice of what is held out.
    """

    path: Path
    rays: Rays
    exit_surface: ExitSurface
    surface_kind: str
    seed: int = 0
    index: float = 1.0
    opaque: bool = True

    @property
    def emission(self) -> MeasuredLuminaire:
        """What is known of the emitters: see `brightest`."""
        return self

    @staticmethod
    def brightest() -> NDArray[np.float64]:
        """No bound on the radiance is known: [3] of infinity."""
        return np.full(3, np.inf)

    @cached_property
    def records(self) -> ExitRecords:
        """All rays where they leave the surface, with weights whose mean is the flux."""
        return _leaving(self.rays, self.exit_surface)[0]

    @cached_property
    def _order(self) -> NDArray[np.int64]:
        """The rays at random: those held out, then the others."""
        return np.random.default_rng([self.seed, 2]).permutation(len(self.records))

    @property
    def held_out_count(self) -> int:
        return round(HELD_OUT_SHARE * len(self.records))

    def is_scarce(self, draws: int) -> bool:
        """Whether so many draws would show the same rays many times."""
        return draws > SCARCE * len(self.records)

    def trace(
        self, paths: int, seed: int, progress: Callable[[int], None] = lambda _: None
    ) -> ExitRecords:
        """Up to `paths` of the rays to train on, in random order."""
        pool = self._order[self.held_out_count :]
        order = np.random.default_rng([seed, 3]).permutation(pool)[:paths]
        progress(paths)
        return self._scaled(order)

    def held_out(self, seed: int) -> ExitRecords:
        """The rays that are never trained on."""
        return self._scaled(self._order[: self.held_out_count])

    def _scaled(self, index: NDArray[np.int64]) -> ExitRecords:
        """Some of the rays, scaled so that in every channel they are as bright as all."""
        part = self.records.take(index)
        sums = part.weight.sum(0, dtype=np.float64)
        wanted = self.rays.flux * len(index)
        scale = np.divide(wanted, sums, out=np.zeros(3), where=sums > 0)
        return replace(part, weight=(part.weight * scale).astype(np.float32), paths=len(index))

    def facts(self) -> dict[str, Any]:
        """What the metrics tell of the rays."""
        return {
            "rays": len(self.rays),
            "held_out_rays": self.held_out_count,
            "lumens": self.rays.lumens,
            "colors": self.rays.colors,
            "exit_surface": self.surface_kind,
            "not_carried": ["transparency"],
            "notes": list(self.rays.notes),
        }


def load_measured(path: Path, seed: int = 0, surface: str = AUTO) -> MeasuredLuminaire:
    """Reads a ray file and finds where its rays leave the lamp.

    Arguments:
        surface: `auto`, `start` or `tight` (`virtual_surface`), or a mesh file in metres.

    Raises:
        PureLightError: The file is no ray file or has too few rays, or much of its light passes
            beside the surface.
    """
    rays = rays_of(read_ray_file(path), MOST_RAYS, seed)
    if len(rays) < LEAST_RAYS:
        raise PureLightError(f"{path}: has {len(rays)} rays; {LEAST_RAYS} are the least to learn")
    if surface in (AUTO, START, TIGHT):
        positions, triangles, kind = virtual_surface(rays, surface)
        exit_surface = ExitSurface(positions, triangles, np.zeros(len(triangles), bool))
    else:
        vertices, faces = read_surface(Path(surface))
        kind = Path(surface).name
        rng = np.random.default_rng([seed, 1])
        exit_surface = visible_part(vertices, faces, None, VISIBILITY_RAYS, rng)
    _, met = _leaving(rays, exit_surface)
    kept = rays.take(met)
    beside = 1 - kept.flux.sum() / rays.flux.sum()
    if beside > BESIDE:
        raise PureLightError(
            f"{path}: {100 * beside:.3g} % of its light passes beside {kind}; is the mesh in "
            "metres, and in the frame of the rays?"
        )
    for note in kept.notes:
        warnings.warn(f"{path.name}: {note}", stacklevel=2)
    return MeasuredLuminaire(path, kept, exit_surface, kind, seed)


def ray_digest(path: Path) -> str:
    """SHA-256 of a ray file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(DIGEST_CHUNK):
            digest.update(part)
    return digest.hexdigest()


def _leaving(rays: Rays, surface: ExitSurface) -> tuple[ExitRecords, NDArray[np.int64]]:
    """The rays where who looks back along them meets the surface, and which those are."""
    centre, radius = np.asarray(surface.sphere.center), surface.sphere.radius
    ahead = np.einsum("nd,nd->n", centre - rays.position, rays.direction) + 2 * radius
    origin = (rays.position + ahead[:, None] * rays.direction).astype(np.float32)
    hits = surface.intersect(origin, -rays.direction)
    count, met = len(hits.index), hits.index
    records = ExitRecords(
        position=hits.position, normal=hits.normal, shading=hits.normal,
        direction=rays.direction[met], weight=rays.power[met] * np.float32(count),
        free=np.full(count, np.inf, np.float32), bare=np.zeros(count, bool), paths=count,
        counted=True,
    )  # fmt: skip
    return records, met
