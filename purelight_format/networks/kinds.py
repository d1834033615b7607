"""The kinds of networks that a bundle may carry, one declaration each; all else loops over them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from purelight_format.networks.probes import (
    Arrays,
    Extent,
    pdf_probes,
    point_probes,
    sampler_probes,
    surface_probes,
)

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Input:
    """What a network is asked with.

    Arguments:
        shape: of one sample.
        unit: whether it is a vector of length one.
        square: whether it lies in [0, 1].
    """

    shape: Shape
    unit: bool = False
    square: bool = False


@dataclass(frozen=True)
class Yardstick:
    """How far an answer is off.

    Arguments:
        name: of the error.
        unit: the size that counts as small, from the radiance scale in W/(m² sr); zero if none
            does, so that errors are relative.
        error: of a result, for people: from the result, what is right, and the radiance scale.
    """

    name: str
    unit: Callable[[float], float]
    error: Callable[[np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Output:
    """What a network answers.

    Arguments:
        shape: of one sample.
        yardstick: how errors of it are measured.
        range: its least and its largest value.
        shines: whether it is light, which is zero in a channel that carries no flux.
    """

    shape: Shape
    yardstick: Yardstick
    range: tuple[float, float] = (-math.inf, math.inf)
    shines: bool = False


@dataclass(frozen=True)
class Kind:
    """One kind of network.

    Arguments:
        inputs, outputs: by name, in their order.
        probes: makes inputs of a lamp to check it on.
        ability: what a lamp can do that has it; nothing of one that only serves another.
        needs: the networks that must come with it.
        required: whether every bundle has it.
    """

    inputs: dict[str, Input]
    outputs: dict[str, Output]
    probes: Callable[[Extent, int, np.random.Generator], Arrays]
    ability: str = ""
    needs: tuple[str, ...] = ()
    required: bool = False

    def units(self, radiance_scale: float) -> dict[str, float]:
        """The size of each output that counts as small."""
        return {k: output.yardstick.unit(radiance_scale) for k, output in self.outputs.items()}


def _logarithmic(result: np.ndarray, right: np.ndarray, radiance_scale: float) -> np.ndarray:
    """Of log1p(radiance / scale), in which networks are trained."""
    low = -0.5 * radiance_scale  # A wrong sign is an error, not an invalid logarithm.
    wrong, true = (np.log1p(np.maximum(y, low) / radiance_scale) for y in (result, right))
    return wrong - true


def _relative(result: np.ndarray, right: np.ndarray, _: float) -> np.ndarray:
    return (result - right) / np.where(right == 0, 1, right)


def _plain(result: np.ndarray, right: np.ndarray, _: float) -> np.ndarray:
    return result - right


RADIANCE = Yardstick("log1p error", lambda scale: scale, _logarithmic)
DENSITY = Yardstick("relative error", lambda _: 0.0, _relative)
PLAIN = Yardstick("error", lambda _: 1.0, _plain)  # Of directions, and of what is about one.

POSITIVE = (0.0, math.inf)
POINT, DIRECTION, SQUARE = Input((3,)), Input((3,), unit=True), Input((2,), square=True)
SURFACE = {"position": POINT, "normal": DIRECTION, "outgoing": DIRECTION}

KINDS = {
    "appearance": Kind(
        inputs=SURFACE,
        outputs={"radiance": Output((3,), RADIANCE, POSITIVE, shines=True)},
        probes=surface_probes,
        ability="be looked at, and light a room",
        required=True,
    ),
    "transparency": Kind(
        inputs=SURFACE,
        outputs={"transmittance": Output((3,), PLAIN, (0.0, 1.0))},
        probes=surface_probes,
        ability="be seen through",
    ),
    "sampler": Kind(
        inputs={"point": POINT, "u": SQUARE},
        outputs={
            "toward": Output((3,), PLAIN),
            "pdf_solid_angle": Output((), DENSITY, POSITIVE),
        },
        probes=sampler_probes,
        ability="sample its own light (accurate mode)",
        needs=("sampler_pdf",),
    ),
    "sampler_pdf": Kind(
        inputs={"point": POINT, "toward": DIRECTION},
        outputs={"pdf_solid_angle": Output((), DENSITY, POSITIVE)},
        probes=pdf_probes,
    ),
    "fast_map": Kind(
        inputs={"point": POINT},
        outputs={"radiance_map": Output((16, 16, 3), RADIANCE, POSITIVE, shines=True)},
        probes=point_probes,
        ability="light from a 16 x 16 map (fast mode)",
    ),
}
