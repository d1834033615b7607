"""Golden vectors: inputs and float64 outputs by which a host proves that it evaluates a network."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.issues import Issue, fail, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.members import npy
from purelight_format.networks.kinds import KINDS

Shapes = dict[str, tuple[int, ...]]


class Signature(NamedTuple):
    """Inputs and outputs of a network in order: name -> shape of one sample."""

    inputs: Shapes
    outputs: Shapes


SIGNATURES = {
    network: Signature(
        {name: given.shape for name, given in kind.inputs.items()},
        {name: answer.shape for name, answer in kind.outputs.items()},
    )
    for network, kind in KINDS.items()
}


def answers(network: str) -> int:
    """Numbers that a network gives for one sample, in all of its outputs."""
    return sum(map(math.prod, SIGNATURES[network].outputs.values()))


@dataclass(frozen=True)
class Vectors:
    """Golden vectors of one network, N of them.

    Arguments:
        network: a key of `SIGNATURES`.
        inputs: float32 [N, ...] by name.
        outputs: float64 [N, ...] by name, evaluated in float64.
        tolerances: float64, shaped as the outputs: the largest error in the output's own unit
            with which a float32 host conforms.
    """

    network: str
    inputs: dict[str, np.ndarray]
    outputs: dict[str, np.ndarray]
    tolerances: dict[str, np.ndarray]

    def to_members(self) -> dict[str, bytes]:
        """Serialises the vectors as bundle members."""
        groups = (self.inputs, self.outputs, self.tolerances)
        arrays = {
            member: np.asarray(groups[group][name]).astype(dtype)
            for member, (group, name, dtype, _) in layout(self.network).items()
        }
        return npy.to_members(arrays)

    @staticmethod
    def from_members(
        network: str, read: Callable[[str], bytes], limits: Limits = LIMITS
    ) -> Vectors:
        """Reads and checks the vectors of a network.

        Arguments:
            network: a key of `SIGNATURES`.
            read: returns the bytes of a member.
            limits: what is accepted.

        Raises:
            FormatError: With a PLX_NPY or PLX_GOLDEN code.
        """
        groups: tuple[dict[str, np.ndarray], ...] = ({}, {}, {})
        count = None
        for member, (group, name, dtype, shape) in layout(network).items():
            array = npy.loads(read(member), member, dtype, limits)
            npy.require_shape(array, member, (count, *shape))
            groups[group][name], count = array, len(array)
        vectors = Vectors(network, *groups)
        vectors._require_sane(limits.vectors)
        return vectors

    def __len__(self) -> int:
        return len(next(iter(self.inputs.values())))

    def _require_sane(self, most: int) -> None:
        if not 1 <= len(self) <= most:
            where = f"vectors/{self.network}"
            fail("PLX_GOLDEN_SHAPE", where, count=len(self), limit=most)
        for name, tolerance in self.tolerances.items():
            if (tolerance < 0).any():
                fail("PLX_GOLDEN_TOLERANCE_INVALID", f"vectors/{self.network}.{name}")


def layout(network: str) -> dict[str, tuple[int, str, str, tuple[int, ...]]]:
    """Members of a network's vectors: name -> (group, tensor, element type, sample shape).

    The groups are 0 for inputs, 1 for outputs and 2 for tolerances.
    """
    inputs, outputs = SIGNATURES[network]
    kinds = ((0, inputs, "<f4", ""), (1, outputs, "<f8", ""), (2, outputs, "<f8", ".tolerance"))
    return {
        f"vectors/{network}.{name}{ending}.npy": (group, name, dtype, shape)
        for group, shapes, dtype, ending in kinds
        for name, shape in shapes.items()
    }


@dataclass(frozen=True)
class Comparison:
    """How well an evaluation meets the golden vectors.

    Arguments:
        passed: [N] whether every output of a vector is within tolerance.
        error: the largest error by output, as its kind measures it.
    """

    passed: np.ndarray
    error: dict[str, float]


def compare(
    vectors: Vectors, results: Mapping[str, np.ndarray], radiance_scale: float = 1.0
) -> Comparison:
    """Compares a host's results with the golden vectors.

    A vector passes where `|result - output| <= tolerance` in every element; anything not finite
    fails. The errors are for people and are measured where a network is trained.

    Arguments:
        vectors: the golden vectors.
        results: the host's outputs by name, [N, ...].
        radiance_scale: the manifest's, in W/(m² sr).

    Raises:
        PureLightError: If an output is missing or has another shape.
    """
    passed, errors, answers = np.ones(len(vectors), bool), {}, KINDS[vectors.network].outputs
    for name, expected in vectors.outputs.items():
        result = _result(results, name, expected.shape)
        with np.errstate(all="ignore"):
            within = np.abs(result - expected) <= vectors.tolerances[name]
            off = answers[name].yardstick.error(result, expected, radiance_scale)
            error = np.abs(off).max(initial=0)
        passed &= within.reshape(len(vectors), -1).all(1)
        errors[name] = float(error) if np.isfinite(result).all() else math.inf
    return Comparison(passed, errors)


def _result(results: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...]) -> np.ndarray:
    result = np.asarray(results.get(name), np.float64)
    if result.shape != shape:
        raise PureLightError(f"{name} has the shape {result.shape}, but must have {shape}")
    return result


def beyond(vectors: Vectors, name: str, channels: tuple[bool, bool, bool]) -> Iterator[Issue]:
    """Issues of an output that is, by more than its tolerance, what no network can give.

    Arguments:
        name: of the output.
        channels: which of R, G and B carry flux.
    """
    where = f"vectors/{vectors.network}.{name}"
    answer, output = KINDS[vectors.network].outputs[name], vectors.outputs[name]
    slack, (least, most) = vectors.tolerances[name], answer.range
    if count := int(((output < least - slack) | (output > most + slack)).sum()):
        expected = f"at least {least:g}" + ("" if most == math.inf else f", at most {most:g}")
        yield issue("PLX_GOLDEN_RANGE", where, count=count, expected=expected)
    if answer.shines and (count := int((abs(output) > slack)[..., ~np.array(channels)].sum())):
        yield issue("PLX_GOLDEN_CHANNEL", where, count=count)
