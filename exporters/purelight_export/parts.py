"""The networks of a run as they go into a bundle: ONNX bytes, what they stand for, and probes."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from purelight_export.networks import EXPORTED, Exported
from purelight_format.errors import PureLightError
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.probes import Arrays, Extent
from purelight_onnx.session import Session
from purelight_train.runs.run_directory import RunDirectory

AGREEMENT = {"fp32": 1e-3, "compact": 2e-2}
PROBES = 512


@dataclass(frozen=True)
class Part:
    """One network of the bundle.

    Arguments:
        name: Its name in the bundle.
        model: ONNX bytes.
        module: The torch module it was made from.
        method: The module's method that it must equal.
        probes: Inputs to check it on, the hard cases first.
        units: The size of each output that counts as small.
        uniform_fraction: Weight of the uniform cap, for the sampler.
    """

    name: str
    model: bytes
    module: nn.Module
    method: str
    probes: Arrays
    units: dict[str, float]
    uniform_fraction: float | None = None


def make_parts(
    run: RunDirectory, extent: Extent, wanted: Sequence[str], *, compact: bool = False
) -> list[Part]:
    """Builds networks that the run has: those that are wanted or required, and what they need.

    Arguments:
        run: A finished run directory.
        wanted: Some of `choices.NETWORKS`.
    """
    rng = np.random.default_rng(0)
    names = {name for name, kind in KINDS.items() if kind.required or name in wanted}
    names |= {other for name in names for other in KINDS[name].needs}
    chosen = {k: made for k, made in EXPORTED.items() if k in names and run.finished(made.trained)}
    modules = _modules(run, chosen.values())
    return [
        Part(
            name, made.graph(modules[made.trained], compact=compact), modules[made.trained],
            made.method, KINDS[name].probes(extent, PROBES, rng),
            KINDS[name].units(run.description.radiance_scale), made.uniform_fraction,
        )
        for name, made in chosen.items()
    ]  # fmt: skip


def _modules(run: RunDirectory, chosen: Iterable[Exported]) -> dict[str, nn.Module]:
    """The trained networks that some are made from, each read once."""
    kinds = {made.trained: made.module for made in chosen}
    return {trained: run.network(trained, kind) for trained, kind in kinds.items()}


def disagreement(part: Part) -> float:
    """Error of the ONNX network in float32 against torch in float64.

    Returns:
        The 99th percentile of |difference| / (|value| + unit) over the probes and outputs; the
        few rows beyond lie on rims, where rounding decides between zero and a density.
    """
    result = Session(part.model, name=part.name)(part.probes)
    expected = _in_torch(part)
    errors = []
    for (name, value), wanted in zip(result.items(), expected, strict=True):
        size = np.abs(wanted) + max(part.units[name], 1e-30)
        errors.append((np.abs(value - wanted) / size).reshape(len(value), -1).max(1))
    return float(np.quantile(np.max(errors, axis=0), 0.99))


def require_agreement(part: Part, *, compact: bool) -> float:
    """Returns `disagreement`, once it is known to be small.

    Raises:
        PureLightError: If the ONNX network is not the trained network.
    """
    error, limit = disagreement(part), AGREEMENT["compact" if compact else "fp32"]
    if not error <= limit:
        raise PureLightError(
            f"{part.name}: the ONNX network differs from the trained one by {error:.2g} "
            f"(at most {limit:g}); nothing was written"
        )
    return error


@torch.no_grad()
def _in_torch(part: Part) -> list[np.ndarray]:
    """The module's outputs on the probes in float64."""
    module = copy.deepcopy(part.module).double()
    tensors = [torch.from_numpy(array).double() for array in part.probes.values()]
    outputs = getattr(module, part.method)(*tensors)
    return [t.numpy() for t in (outputs if isinstance(outputs, tuple) else (outputs,))]
