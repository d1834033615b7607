"""Rays in the units of the format."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import lumens

Float = NDArray[np.float32]


@dataclass(frozen=True)
class Rays:
    """Light as rays in the luminaire frame.

    Arguments:
        position: [N, 3] where each starts, in metres.
        direction: [N, 3] unit vectors.
        power: [N, 3] W per linear Rec.709 channel, none negative.
        colors: how their colours came about, in words.
        notes: what a user should be warned of.
    """

    position: Float
    direction: Float
    power: Float
    colors: str = ""
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.position)

    @property
    def flux(self) -> NDArray[np.float64]:
        """Total power in W per channel: [3]."""
        total: NDArray[np.float64] = self.power.sum(0, dtype=np.float64)
        return total

    @property
    def lumens(self) -> float:
        """Total luminous flux."""
        return lumens(self.flux)

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_] | slice) -> Rays:
        """Some of the rays, as they are."""
        return replace(
            self, position=self.position[index], direction=self.direction[index],
            power=self.power[index],
        )  # fmt: skip

    def moved(self, matrix: NDArray[np.float64]) -> Rays:
        """The rays after a rotation, a scale and a translation, [4, 4]; powers stay."""
        turned = self.direction @ matrix[:3, :3].T
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        position = self.position @ matrix[:3, :3].T + matrix[:3, 3]
        return replace(
            self, position=position.astype(np.float32), direction=turned.astype(np.float32)
        )  # fmt: skip
