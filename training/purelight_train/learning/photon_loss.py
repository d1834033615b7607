r"""Fitting radiance straight to photons, without a density model to normalise (design, `photons`).

With f = radiance / scale, reference pairs uniform by area x projected solid angle, and photons of
relative weight w, both losses below are least where f is the lamp's radiance:

- `poisson`: the likelihood of a Poisson process with intensity f,
  :math:`E_{ref}[f] - E_{photon}[w \log f]`;
- `logistic`: telling photons from `ratio` times as many reference pairs (noise-contrastive
  estimation, Gutmann and Hyvaerinen 2010), whose gradients are bounded where f is huge:
  :math:`r\,E_{ref}[\log(1 + f / r)] + E_{photon}[w \log(1 + r / f)]`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn.functional import softplus

from purelight_format.errors import PureLightError
from purelight_train.learning.photon_batches import Chunk
from purelight_train.networks.student import Student
from purelight_train.presets import Preset

Loss = Callable[[Tensor, Tensor, Tensor, Tensor], Tensor]


def poisson(photon: Tensor, weight: Tensor, reference: Tensor, measure: Tensor) -> Tensor:
    """Negative log-likelihood.

    Arguments:
        photon, reference: log f at photons [N, C] and at reference pairs [M, C].
        weight: [N, C] of the photons, of mean one.
        measure: [M, 1] of all reference pairs over pi times the area.
    """
    return (torch.exp(reference) * measure).mean() - (weight * photon).mean()


def logistic(ratio: float) -> Loss:
    """Classification loss with `ratio` reference pairs a photon; arguments as for `poisson`."""
    shift = math.log(ratio)

    def loss(photon: Tensor, weight: Tensor, reference: Tensor, measure: Tensor) -> Tensor:
        missed = softplus(shift - photon) * weight
        return ratio * (softplus(reference - shift) * measure).mean() + missed.mean()

    return loss


def chosen_loss(preset: Preset) -> Loss:
    """The loss a preset names.

    Raises:
        PureLightError: there is none of that name.
    """
    losses = {"poisson": poisson, "logistic": logistic(preset.reference_ratio)}
    if preset.photon_loss not in losses:
        raise PureLightError(f"no photon loss '{preset.photon_loss}'; take one of {sorted(losses)}")
    return losses[preset.photon_loss]


def student_loss(student: Student, photons: Chunk, references: Chunk, loss: Loss) -> Tensor:
    """Loss of a student with the link `log` on rows of `photon_batches`, channels present only."""
    *photon_rays, weight = photons
    *reference_rays, measure = references
    rays = (torch.cat(pair) for pair in zip(photon_rays, reference_rays, strict=True))
    present = student.channels.bool()
    log = student.log_radiance(*rays)[:, present]
    return loss(log[: len(weight)], weight[:, present], log[len(weight) :], measure)
