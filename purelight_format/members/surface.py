"""The exit surface: the triangles from which light leaves, and the flux of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from purelight_format.issues import Issue, fail, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.measures import BoundingSphere
from purelight_format.members import finishes, npy

MEMBERS = {
    "positions": ("surface/positions.npy", "<f4"),
    "triangles": ("surface/triangles.npy", "<u4"),
    "triangle_flux": ("surface/triangle_flux.npy", "<f4"),
}
SPHERE_SLACK = 1e-5  # Rounding of float32 positions against the radius.
CLOSURE = 0.01
CHUNK = 1 << 18  # Triangles at a time.


@dataclass(frozen=True)
class Surface:
    """A triangle mesh in the luminaire frame.

    Arguments:
        positions: [V, 3] float32, metres.
        triangles: [T, 3] uint32 indices into positions, any orientation.
        triangle_flux: [T, 3] float32, W per linear Rec.709 channel.
        finish: [T, 2] uint8, index of the manifest's finish of the front, from where the corners
            turn counterclockwise, and of the back; `finishes.NONE` where there is none. None in
            a lamp without finishes.
    """

    positions: np.ndarray
    triangles: np.ndarray
    triangle_flux: np.ndarray
    finish: np.ndarray | None = None

    def to_members(self) -> dict[str, bytes]:
        """Serialises the surface as bundle members."""
        arrays = {
            member: np.asarray(getattr(self, field)).astype(dtype)
            for field, (member, dtype) in MEMBERS.items()
        }
        if self.finish is not None:
            arrays[finishes.MEMBER] = self.finish.astype(finishes.DTYPE)
        return npy.to_members(arrays)

    @staticmethod
    def from_members(
        read: Callable[[str], bytes], limits: Limits = LIMITS, finish_count: int = 0
    ) -> Surface:
        """Reads and checks a surface.

        Arguments:
            read: returns the bytes of a member.
            limits: what is accepted.
            finish_count: how many finishes the manifest has.

        Raises:
            FormatError: With a PLX_NPY or PLX_SURFACE code.
        """
        arrays = {
            field: npy.loads(read(member), member, dtype, limits)
            for field, (member, dtype) in MEMBERS.items()
        }
        for field, array in arrays.items():
            rows = len(arrays["triangles"]) if field == "triangle_flux" else None
            npy.require_shape(array, MEMBERS[field][0], (rows, 3))
        finish = None
        if finish_count:
            finish = npy.loads(read(finishes.MEMBER), finishes.MEMBER, finishes.DTYPE, limits)
        surface = Surface(**arrays, finish=finish)
        surface._require_indices()
        if finish is not None:
            finishes.require_indices(finish, len(surface.triangles), finish_count)
        if (surface.triangle_flux < 0).any():
            fail("PLX_SURFACE_FLUX", MEMBERS["triangle_flux"][0])
        return surface

    def _require_indices(self) -> None:
        if not len(self.triangles):
            fail("PLX_SURFACE_EMPTY", MEMBERS["triangles"][0])
        bad = np.flatnonzero((self.triangles >= len(self.positions)).any(1))
        if len(bad):
            fail("PLX_SURFACE_INDEX", MEMBERS["triangles"][0], triangle=bad[0])

    def area(self) -> np.ndarray:
        """Area of each triangle: [T] in m², float64."""
        a, b, c = (self.positions.astype(np.float64)[self.triangles[:, k]] for k in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    def crowding(self, radius: float) -> float:
        """How many triangles a ray through the sphere may have to be tested against.

        The sum of the areas of their boxes over that of the sphere's box: what a hierarchy of
        boxes leaves to be tested (the surface area heuristic).
        """
        total = 0.0
        for first in range(0, len(self.triangles), CHUNK):
            corner = self.positions[self.triangles[first : first + CHUNK]].astype(np.float64)
            a, b, c = ((corner.max(1) - corner.min(1)) / (2 * radius)).T
            total += float((a * b + b * c + c * a).sum()) / 3
        return total

    def issues(
        self, sphere: BoundingSphere, flux: tuple[float, ...], limits: Limits = LIMITS
    ) -> Iterator[Issue]:
        """Compares the surface with the manifest's bounding sphere and flux."""
        offset = self.positions.astype(np.float64) - sphere.center
        distance = np.sqrt((offset * offset).sum(1).max(initial=0)) / sphere.radius
        if distance > 1 + SPHERE_SLACK:
            where = MEMBERS["positions"][0]
            yield issue("PLX_SURFACE_OUTSIDE_SPHERE", where, distance=distance)
        crowding = self.crowding(sphere.radius)
        if crowding > limits.crowding:
            where = MEMBERS["triangles"][0]
            yield issue("PLX_SURFACE_CROWDED", where, count=round(crowding), limit=limits.crowding)
        total = self.triangle_flux.sum(0, dtype=np.float64)
        for channel, (sums, stated) in enumerate(zip(total, flux, strict=True)):
            if abs(sums - stated) > CLOSURE * stated:
                ratio = sums / stated if stated else np.inf
                yield issue("PLX_SURFACE_FLUX_CLOSURE", MEMBERS["triangle_flux"][0],
                            channel=channel, ratio=ratio)  # fmt: skip
