"""A task's true picture, of two independent halves, and which of its pixels are judged."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format import atomic
from purelight_train.truth.picture import Picture

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Truth:
    """What a task looks like with the real lamp.

    Arguments:
        picture: light traced, with its halves and standard error.
        mask: [H, W] pixels that are judged.
        paths: that were traced.
        seconds: wall-clock.
    """

    picture: Picture
    mask: Mask
    paths: int
    seconds: float

    def save(self, path: Path) -> None:
        """Write as `.npz`."""
        buffer = io.BytesIO()
        first, second = self.picture.halves
        arrays: dict[str, Any] = {
            "image": self.picture.image, "first": first, "second": second,
            "error": self.picture.error,
        }  # fmt: skip
        np.savez_compressed(
            buffer,
            mask=self.mask,
            cost=np.array([self.paths, self.seconds]),
            **{name: array.astype(np.float32) for name, array in arrays.items()},
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(path, buffer.getvalue())

    @staticmethod
    def load(path: Path) -> Truth:
        """Inverse of `save`."""
        with np.load(path) as data:
            image, first, second, error = (
                data[name].astype(np.float64) for name in ("image", "first", "second", "error")
            )
            paths, seconds = data["cost"].tolist()
            picture = Picture(image, (first, second), error)
            return Truth(picture, data["mask"], int(paths), seconds)
