"""The networks of a run as they go into a bundle: ONNX bytes, what they stand for, and probes."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from purelight_export import networks
from purelight_format.errors import PureLightError
from purelight_format.networks.probes import (
    Arrays,
    pdf_probes,
    points,
    sampler_probes,
    surface_probes,
)
from purelight_onnx.session import Session
from purelight_train.light.description import Description
from purelight_train.runs.run_directory import Networks

CHOICES = ("appearance", "transparency", "sampler", "fast_map")
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
    trained: Networks,
    description: Description,
    surface: tuple[np.ndarray, np.ndarray],
    wanted: Sequence[str],
    *,
    compact: bool = False,
) -> list[Part]:
    """Builds the wanted networks that the run has; a sampler brings its pdf network along."""
    rng = np.random.default_rng(0)
    see_through = trained.transparency
    sphere, r_max, scale = description.sphere, description.r_max, description.radiance_scale
    makers: dict[str, Callable[[], list[Part]]] = {
        "appearance": lambda: [
            Part(
                "appearance", networks.appearance(trained.student, compact=compact),
                trained.student, "forward", surface_probes(*surface, PROBES, rng),
                {"radiance": scale},
            )
        ],
        "transparency": lambda: [] if see_through is None else [
            Part(
                "transparency", networks.transparency(see_through, compact=compact),
                see_through, "forward", surface_probes(*surface, PROBES, rng),
                {"transmittance": 1.0},
            )
        ],
        "sampler": lambda: [
            Part(
                "sampler", networks.sampler(trained.sampler, compact=compact),
                trained.sampler, "forward", sampler_probes(sphere, r_max, PROBES, rng),
                {"toward": 1.0, "pdf_solid_angle": 0.0}, trained.sampler.uniform_fraction,
            ),
            Part(
                "sampler_pdf", networks.sampler_pdf(trained.sampler, compact=compact),
                trained.sampler, "pdf_solid_angle", pdf_probes(sphere, r_max, PROBES, rng),
                {"pdf_solid_angle": 0.0},
            ),
        ],
        "fast_map": lambda: [
            Part(
                "fast_map", networks.fast_map(trained.fast_map, compact=compact),
                trained.fast_map, "forward", {"point": points(sphere, r_max, PROBES, rng)},
                {"radiance_map": scale},
            )
        ],
    }  # fmt: skip
    return [part for name in CHOICES if name in wanted for part in makers[name]()]


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
