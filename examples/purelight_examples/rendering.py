"""Pictures by Mitsuba, timed: a set number of paths per pixel, or as many as a time allows."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from purelight_mitsuba.platform import reading
from purelight_train.truth.metrics import mape, relative_mse

Image = NDArray[np.float64]


@dataclass(frozen=True)
class Rendering:
    """A picture [H, W, 3] in W/(m² sr), with what it cost.

    Arguments:
        halves: the means of the even and of the odd passes, whose difference shows the noise.
    """

    image: Image
    spp: int
    seconds: float
    halves: tuple[Image, Image]

    def noise(self) -> dict[str, float]:
        """What `errors` gives for this picture against the truth, judged from its two halves.

        Their difference has twice the standard error of their mean: a first-order metric is
        halved and a second-order one quartered.
        """
        apart = errors(*self.halves)
        order = {"mape": 1, "mape_blocks": 1, "relative_mse": 2}
        return {name: error / 2 ** order[name] for name, error in apart.items()}


def errors(image: Image, reference: Image) -> dict[str, float]:
    """MAPE, MAPE of means over 4x4 pixels (little noise, all of the bias), and relative MSE."""
    return {
        "mape": mape(image, reference),
        "mape_blocks": mape(blocks(image), blocks(reference)),
        "relative_mse": relative_mse(image, reference),
    }


def blocks(image: Image, side: int = 4) -> Image:
    """Means over squares of pixels; what is left over at the right and below is dropped."""
    height, width = (length // side for length in image.shape[:2])
    cut = image[: height * side, : width * side]
    return cut.reshape(height, side, width, side, -1).mean((1, 3))


def render(scene: Path, spp: int, title: str = "room", pass_spp: int = 8) -> Rendering:
    """Render a scene file with its own integrator, `spp` paths per pixel in two passes or more."""
    passes = max(2, -(-spp // pass_spp))
    return _render(scene, title, -(-spp // passes), lambda done, used: done / passes)


def render_for(scene: Path, seconds: float, title: str = "room", pass_spp: int = 4) -> Rendering:
    """Render passes of `pass_spp` until the time is used, two at the least."""

    def progress(done: int, used: float) -> float:
        return (used + 0.5 * used / max(done, 1)) / seconds

    return _render(scene, title, pass_spp, progress)


def _render(
    scene: Path, title: str, pass_spp: int, progress: Callable[[int, float], float]
) -> Rendering:
    """Render passes until `progress(passes, seconds)` reaches one.

    The seconds are those of rendering, with the compilation of its kernels, without loading.
    """
    with reading():
        loaded = mi.load_file(str(scene))
    sums: list[Any] = [0.0, 0.0]
    start, done = time.perf_counter(), 0
    with tqdm(total=100, desc=title, bar_format=BAR) as bar:
        while done < 2 or progress(done, time.perf_counter() - start) < 1:
            sums[done % 2] += _image(mi.render(loaded, spp=pass_spp, seed=done))
            done += 1
            bar.n = min(100, round(100 * progress(done, time.perf_counter() - start)))
            bar.refresh()
    seconds = time.perf_counter() - start
    halves = (sums[0] / ((done + 1) // 2), sums[1] / (done // 2))
    return Rendering((sums[0] + sums[1]) / done, pass_spp * done, seconds, halves)


BAR = "  {desc}: {percentage:3.0f} % |{bar:40}| {elapsed}"


def _image(rendered: Any) -> Image:
    return np.array(rendered, dtype=np.float64)[..., :3]
