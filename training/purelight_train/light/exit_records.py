"""Exit records: where, whereto and with how much power light left the surface of a lamp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere
from purelight_train.light.exit_surface import NEAR, ExitSurface, Hits

Float = NDArray[np.float32]
LEAST_SEEN = 0.02  # part of rays that stays however short their way is


@dataclass(frozen=True)
class ExitRecords:
    """Light that left a surface of the lamp, for good or to meet the lamp again.

    Arguments:
        position: [N, 3] exit points in metres.
        normal: [N, 3] geometric unit normals on the side of `direction`; zero where `bare`.
        shading: [N, 3] unit normals of the scene's own shading frame, on the side of `normal`.
        direction: [N, 3] unit directions.
        weight: [N, 3] path weights f/q in W per channel; over `paths`, the sum of those that
            escape is the flux.
        free: [N] metres to the next surface of the lamp; infinite for light that escapes.
        bare: [N] light that came straight from an emitter, without a scattering vertex.
        paths: number of emitted paths.
        dropped: paths left out because a value was not finite.
        cut: paths ended early because they were too long.
        needles: sum of the weights that left, over the channels, of light of emitters without area
            which nothing but smooth surfaces met: rays, where a picture needs radiance.
        counted: whether `paths` is itself a matter of chance, as the number of measured rays is.
    """

    position: Float
    normal: Float
    shading: Float
    direction: Float
    weight: Float
    free: Float
    bare: NDArray[np.bool_]
    paths: int
    dropped: int = 0
    cut: int = 0
    needles: float = 0.0
    counted: bool = False

    def __len__(self) -> int:
        return len(self.position)

    @cached_property
    def escaped(self) -> NDArray[np.bool_]:
        """Which light leaves the lamp for good: [N]."""
        return np.isinf(self.free)

    @cached_property
    def flux(self) -> NDArray[np.float64]:
        """Escaped power in W per channel, [3], summed in float64."""
        return self.weight.sum(0, dtype=np.float64, where=self.escaped[:, None]) / self.paths

    @cached_property
    def flux_error(self) -> NDArray[np.float64]:
        """Standard error of `flux`, [3] in W; that of a count (Poisson) where `counted`."""
        square = np.square(self.weight, dtype=np.float64)
        second = square.sum(0, where=self.escaped[:, None]) / self.paths
        known = 0.0 if self.counted else self.flux**2
        return np.sqrt(np.maximum(second - known, 0) / self.paths)

    @property
    def channels(self) -> tuple[bool, bool, bool]:
        """Which channels carry flux."""
        r, g, b = (bool(f > 0) for f in self.flux)
        return r, g, b

    def crossings(self, sphere: BoundingSphere, distance: float | NDArray[np.float64]) -> Float:
        """Where light crosses spheres around the lamp, as unit directions from the centre: [N, 3].

        Arguments:
            distance: their radius over the lamp's, one or [N], at least 1.
        """
        start = (self.position.astype(np.float64) - np.asarray(sphere.center)) / sphere.radius
        direction = self.direction.astype(np.float64)
        ahead = (start * direction).sum(1)
        way = np.sqrt(np.maximum(ahead**2 - (start**2).sum(1) + distance**2, 0)) - ahead
        place = start + way[:, None] * direction
        return (place / np.linalg.norm(place, axis=1, keepdims=True)).astype(np.float32)

    def take(self, index: NDArray[Any] | slice) -> ExitRecords:
        """The records at `index`, with `paths` unchanged."""
        return replace(self, **{name: getattr(self, name)[index] for name in _COLUMNS})

    @staticmethod
    def concatenate(parts: Sequence[ExitRecords]) -> ExitRecords:
        """Join the records of several batches."""
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(p, name) for p in parts]) for name in _COLUMNS
        }
        counts: dict[str, Any] = {name: sum(getattr(p, name) for p in parts) for name in _COUNTS}
        return ExitRecords(**columns, **counts, counted=any(p.counted for p in parts))


_COUNTS = ("paths", "dropped", "cut", "needles")
_COLUMNS = tuple(f.name for f in fields(ExitRecords) if f.name not in (*_COUNTS, "counted"))


def seen_share(way: Float, radius: float) -> NDArray[np.float64]:
    """How much rays count by the way that they go before they meet the lamp again: [N] -> [N].

    Arguments:
        way: in metres, infinite for rays that escape.
        radius: of the bounding sphere, in metres.
    """
    return np.clip(np.asarray(way, np.float64) / radius, LEAST_SEEN, 1)


def settle(records: ExitRecords, surface: ExitSurface) -> tuple[ExitRecords, NDArray[np.int64]]:
    """The light that a viewer meets on the exit surface, and where.

    A viewer looks back along the light, from outside of the lamp or, for light that meets the lamp
    again, from half of the way there. Position and geometric normal become those of what the
    viewer meets, which may be a virtual surface that the light passes; light for which that is
    another place, or the inner side of a wall, is left out (a few in a thousand where analytic
    shapes are tessellated, and bare sources without area).

    Returns:
        the records kept, and the triangle of each: [N].
    """
    radius = surface.sphere.radius
    reach = np.minimum(0.5 * records.free, 3 * radius)[:, None]
    hits = surface.intersect(records.position + reach * records.direction, -records.direction)
    index = hits.index
    distance = np.linalg.norm(hits.position - records.position[index], axis=1)
    near = distance < np.minimum(NEAR * radius, 0.5 * reach[index, 0])
    near &= records.escaped[index] | hits.front | surface.two_sided[hits.triangle]
    passed = _passed(records.take(index), surface, hits)
    near |= passed
    kept = records.take(index[near])
    normal = hits.normal[near]
    facing = np.einsum("nd,nd->n", kept.shading, normal)[:, None]
    flat = (kept.bare | passed[near])[:, None]
    shading = np.where(flat, normal, kept.shading * np.sign(facing))
    settled = replace(kept, position=hits.position[near], normal=normal, shading=shading)
    return settled, hits.triangle[near].astype(np.int64)


def _passed(records: ExitRecords, surface: ExitSurface, hits: Hits) -> NDArray[np.bool_]:
    """Which light passes a virtual part of the surface on its way to who looks back: [N]."""
    if surface.virtual is None:
        return np.zeros(len(records), bool)
    ahead = np.einsum("nd,nd->n", hits.position - records.position, records.direction) >= 0
    return ahead & hits.front & surface.virtual[hits.triangle]


def triangle_flux(records: ExitRecords, triangle: NDArray[np.int64], triangles: int) -> Float:
    """Power that escapes from each triangle in W per channel: [triangles, 3]."""
    flux, out = np.zeros((triangles, 3)), records.escaped
    np.add.at(flux, triangle[out], records.weight[out].astype(np.float64) / records.paths)
    return flux.astype(np.float32)


def escaped_part(records: ExitRecords, flux: Sequence[float], count: int) -> tuple[Float, Float]:
    """Directions and weights of the first `count` that escape; the weights sum to the flux."""
    part = records.take(np.flatnonzero(records.escaped)[:count])
    total = part.weight.sum(0, dtype=np.float64)
    scale = np.divide(flux, total, out=np.zeros(3), where=total > 0)
    return part.direction, (part.weight * scale).astype(np.float32)
