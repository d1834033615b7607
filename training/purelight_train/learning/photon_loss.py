r"""Fitting radiance straight to photons, without a density model to normalise (design, `photons`).

With f the radiance over its scale and over the density rho of the reference rays (`ReferenceRays`),
and photons of relative weight w, the losses below are least where f is the lamp's:

- `poisson`: the likelihood of a Poisson process with intensity f,
  :math:`E_{ref}[f] - E_{photon}[w \log f]`;
- `logistic`: telling photons from `ratio` times as many reference rays (noise-contrastive
  estimation, Gutmann and Hyvaerinen 2010), whose gradients are bounded where f is huge:
  :math:`r\,E_{ref}[\log(1 + f / r)] + E_{photon}[w \log(1 + r / f)]`;
- `both`: their sum. What a small network cannot fit, the bounded loss bends towards the bright,
  whereas the stationary point of the likelihood keeps the energy.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import softplus

from purelight_format.errors import PureLightError
from purelight_train.learning.photon_batches import Chunk
from purelight_train.networks.student import Student
from purelight_train.presets import Preset

Loss = Callable[[Tensor, Tensor, Tensor], Tensor]
UNKNOWN_BRIGHTEST = 1e5  # times the mean radiance, where emitters without area set no bound


def poisson(brightest: Tensor) -> Loss:
    """Negative log-likelihood, of the arguments

        photon, reference: log f at photons [N, C] and at reference rays [M, C];
        weight: [N, C] of the photons.

    Arguments:
        brightest: [C] no lamp's f is larger: from there on its exponential goes on as a straight
            line, or one stray ray in a million would outweigh all others; and photons gain nothing,
            or f would grow without end where reference rays are too rare to hold it.
    """
    bound = torch.log(brightest)

    def loss(photon: Tensor, weight: Tensor, reference: Tensor) -> Tensor:
        beyond = (reference - bound).clamp(min=0)
        intensity = torch.exp(torch.minimum(reference, bound)) * (1 + beyond)
        return intensity.mean() - (weight * torch.minimum(photon, bound)).mean()

    return loss


def logistic(ratio: float) -> Loss:
    """Classification loss with `ratio` reference rays a photon; its arguments are `poisson`'s."""
    shift = math.log(ratio)

    def loss(photon: Tensor, weight: Tensor, reference: Tensor) -> Tensor:
        missed = softplus(shift - photon) * weight
        return ratio * softplus(reference - shift).mean() + missed.mean()

    return loss


def both(ratio: float, brightest: Tensor) -> Loss:
    """Sum of `logistic` and `poisson`."""
    bounded, likelihood = logistic(ratio), poisson(brightest)

    def loss(photon: Tensor, weight: Tensor, reference: Tensor) -> Tensor:
        return bounded(photon, weight, reference) + likelihood(photon, weight, reference)

    return loss


def chosen_loss(preset: Preset, brightest: Tensor) -> Loss:
    """The loss a preset names, for the channels present; `brightest` as for `poisson`.

    Raises:
        PureLightError: there is none of that name.
    """
    ratio = preset.reference_ratio
    losses = {
        "poisson": poisson(brightest),
        "logistic": logistic(ratio),
        "both": both(ratio, brightest),
    }
    if preset.photon_loss not in losses:
        raise PureLightError(f"no photon loss '{preset.photon_loss}'; take one of {sorted(losses)}")
    return losses[preset.photon_loss]


def brightest_of(student: Student, emitters: NDArray[np.float64], least_ratio: float) -> Tensor:
    """Bound on f: the largest radiance of the emitters over the scale, of each channel present.

    Arguments:
        emitters: largest radiance, [3].
        least_ratio: the least rho of a reference ray.
    """
    present = student.channels.bool().cpu()
    ratio = torch.from_numpy(emitters).float() / student.scale.cpu() / least_ratio
    return ratio[present].clamp(1, UNKNOWN_BRIGHTEST).to(student.scale.device)


def student_loss(student: Student, photons: Chunk, references: Chunk, loss: Loss) -> Tensor:
    """Loss of a student with the link `log` on rows of `photon_batches`, channels present only."""
    *seen, weight = photons
    *rays, log_ratio = (torch.cat(pair) for pair in zip(seen, references, strict=True))
    present = student.channels.bool()
    log = student.log_radiance(*rays)[:, present] - log_ratio[:, None]
    return loss(log[: len(weight)], weight[:, present], log[len(weight) :])
