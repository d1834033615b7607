"""Fitting to photons: the losses' minima, the measure of the rays, the weights."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from purelight_format.errors import PureLightError
from purelight_train.learning.photon_loss import both, chosen_loss, logistic, poisson
from purelight_train.presets import DRAFT

TRUE = torch.tensor([0.02, 0.5, 3.0, 200.0], dtype=torch.float64)  # radiance of four cells


BRIGHTEST = torch.tensor([1000.0])
LOSSES = [
    poisson(BRIGHTEST), logistic(1.0), logistic(3.0), logistic(30.0), both(0.2, BRIGHTEST),
]  # fmt: skip


@pytest.mark.parametrize("loss", LOSSES)
def test_least_at_the_radiance(loss: Any) -> None:
    """With every cell a reference ray and a photon of the cell's weight, the minimum is TRUE."""
    raw = torch.zeros(4, 1, dtype=torch.float64, requires_grad=True)
    optimizer = torch.optim.LBFGS(
        [raw], max_iter=500, tolerance_change=0, line_search_fn="strong_wolfe"
    )

    def closure() -> torch.Tensor:
        optimizer.zero_grad()
        value: torch.Tensor = loss(raw, TRUE[:, None], raw)
        value.backward()
        return value

    optimizer.step(closure)
    torch.testing.assert_close(raw.detach()[:, 0], TRUE.log(), atol=1e-3, rtol=0)


@pytest.mark.parametrize("loss", LOSSES)
def test_a_stray_ray_neither_outweighs_the_others_nor_is_lost(loss: Any) -> None:
    """At a reference ray of e^40 times the mean the gradient is bounded, and points back."""
    strayed = torch.tensor([[40.0]], requires_grad=True)
    loss(torch.zeros(1, 1), torch.ones(1, 1), strayed).backward()
    assert strayed.grad is not None
    assert 0.1 < float(strayed.grad) < 2000


@pytest.mark.parametrize("loss", LOSSES)
def test_photons_gain_nothing_beyond_any_light(loss: Any) -> None:
    """Where no reference ray falls nothing else holds them; below, each pulls by its weight."""
    photon = torch.tensor([[math.log(900.0)], [40.0]], requires_grad=True)
    loss(photon, torch.ones(2, 1), torch.full((1, 1), -40.0)).backward()
    assert photon.grad is not None
    below, beyond = photon.grad[:, 0].tolist()
    assert below < 0
    assert abs(beyond) < 1e-12


def test_unknown_loss_is_refused() -> None:
    import dataclasses

    with pytest.raises(PureLightError, match="logistic"):
        chosen_loss(dataclasses.replace(DRAFT, photon_loss="cubic"), BRIGHTEST)


def test_rays_are_uniform_by_area_and_projected_angle(lamp: Path) -> None:
    """Their cosine is 2/3 in the mean, and their points are uniform."""
    from purelight_train.light.luminaire import load_luminaire

    surface = load_luminaire(lamp).exit_surface
    rng = np.random.default_rng(0)
    position, normal, outgoing = surface.sample_rays(1 << 18, rng)
    cosine = np.einsum("nd,nd->n", normal, outgoing)
    assert cosine.mean() == pytest.approx(2 / 3, abs=2e-3)
    offset = position - np.asarray(surface.sphere.center)
    assert np.abs(offset.mean(0)).max() < 5e-3 * surface.sphere.radius
    np.testing.assert_allclose((offset**2).mean(0), surface.sphere.radius**2 / 3, rtol=0.02)


def test_photons_weigh_one_in_every_channel(lamp: Path) -> None:
    from purelight_train.learning.photon_batches import seen_photons
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import load_luminaire

    luminaire = load_luminaire(lamp)
    records = trace_records(luminaire.scene, 1, 0)
    surface = luminaire.exit_surface
    references = ReferenceRays.of(surface, *settle(records, surface))
    *_, weight = seen_photons(records, references, records.flux)
    assert len(weight) > 0.99 * len(records)
    np.testing.assert_allclose(weight.mean(0), 1, rtol=0.01)
    *_, red = seen_photons(records, references, records.flux * np.array([1, 0, 0]))
    assert (red[:, 1:] == 0).all()


def test_student_finds_a_lambertian_sphere(lamp: Path, mitsuba: Any) -> None:
    """Endless photons of a bare sphere: the fitted radiance is its own, to a few per cent."""
    import dataclasses

    from purelight_train.learning.photon_batches import PhotonBatches
    from purelight_train.learning.photon_loss import student_loss
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.description import Description
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import load_luminaire
    from purelight_train.networks.student import Student
    from purelight_train.presets import GridSize, MLPSize

    path = lamp.parent / "bare.xml"
    path.write_text(
        '<scene version="3.0.0"><shape type="sphere"><float name="radius" value="0.01"/>'
        '<emitter type="area"><rgb name="radiance" value="3,0,1"/></emitter></shape></scene>'
    )
    luminaire = load_luminaire(path)
    records = trace_records(luminaire.scene, 1, 0)
    description = Description.of(records, luminaire)
    small = dataclasses.replace(
        DRAFT, student_grid=GridSize(1, 2, 4, 4, 1 << 10), student_network=MLPSize(16, 1)
    ).for_route("photons", anchor="none")
    torch.manual_seed(0)
    student = Student(description, small)
    surface = luminaire.exit_surface
    references = ReferenceRays.of(surface, *settle(records, surface))
    batches = PhotonBatches(luminaire, description, references, torch.device("cpu"))
    adam, rng = torch.optim.Adam(student.parameters(), lr=1e-2), np.random.default_rng(0)
    loss = chosen_loss(small, torch.tensor([10.0, 10.0]))
    for step in range(120):
        adam.param_groups[0]["lr"] = 1e-2 * 0.5 * (1 + math.cos(math.pi * step / 120))
        adam.zero_grad()
        student_loss(student, *batches.draw(rng, 1 << 11), loss).backward()
        adam.step()
    *rays, _ = batches.references.draw(rng, 1 << 12)
    with torch.no_grad():
        value = student(*rays).numpy()
    assert (value[:, 1] == 0).all()
    np.testing.assert_allclose(value.mean(0)[[0, 2]], [3, 1], rtol=0.03)
    assert (value.std(0) < 0.08 * np.array([3, 1, 1])).all()
