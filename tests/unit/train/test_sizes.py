"""Sizes of networks: ordered, counted right, no larger than the surface can use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from purelight_export import networks
from purelight_format.measures import BoundingSphere
from purelight_format.networks import tiers
from purelight_format.networks.profile import inspect
from purelight_train.light.description import Description
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import DEGREE, Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import DRAFT, PAPER, STANDARD, Preset
from purelight_train.sizes import portable
from purelight_train.sizes.ladder import SHARES, ladder, part_of, touched, unit_points
from purelight_train.sizes.transparency import square_error

LAMP = Description(
    BoundingSphere((0.0, 0.0, 0.0), 1.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 1.0,
    (True, True, True), 1.0, 1,
)  # fmt: skip


class Disk:
    """A flat surface: it touches few vertices of a fine grid."""

    sphere = LAMP.sphere

    def sample(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        point = np.zeros((count, 3), np.float32)
        point[:, :2] = rng.uniform(-0.7, 0.7, (count, 2))
        return point, np.tile(np.float32([0, 0, 1]), (count, 1))


def test_touched_counts_the_corners_of_cells() -> None:
    assert touched(np.array([[0.1, 0.1, 0.1]]), 4) == 8
    assert touched(np.array([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1]]), 4) == 12
    assert touched(np.array([[1.0, 1.0, 1.0]]), 4) == 8


@pytest.mark.parametrize("anchor", ["none", "straight", "both"])
@pytest.mark.parametrize("base", [DRAFT, STANDARD])
def test_ladder_climbs_to_the_preset(base: Preset, anchor: str) -> None:
    preset = base.for_route("photons", anchor=anchor)
    rungs = ladder(preset, Disk(), np.random.default_rng(0))  # type: ignore[arg-type]
    macs = [rung.macs for rung in rungs]
    assert macs == sorted(macs)
    assert macs[0] < 0.1 * macs[-1]
    assert rungs[-1].preset.student_network == preset.student_network
    for rung in rungs:
        student = Student(LAMP, rung.preset)
        assert rung.weights == sum(p.numel() for p in student.parameters())
        layers = [m.weight.numel() for m in student.network if hasattr(m, "weight")]
        assert rung.macs == sum(layers)
        assert rung.preset.student_grid.table_size <= preset.student_grid.table_size


@pytest.mark.parametrize("base", [DRAFT, STANDARD])
def test_transparencies_grow_to_the_preset(base: Preset) -> None:
    unit = unit_points(Disk(), np.random.default_rng(0))  # type: ignore[arg-type]
    parts = [part_of(base.transparency_grid, base.transparency_network, s, unit) for s in SHARES]
    presets = [replace(base, transparency_grid=g, transparency_network=n) for g, n in parts]
    weights = [sum(p.numel() for p in Transparency(LAMP, p).parameters()) for p in presets]
    assert weights == sorted(weights)
    assert weights[0] < 0.1 * weights[-1]
    assert parts[-1][1] == base.transparency_network
    assert parts[-1][0].finest == base.transparency_grid.finest


@pytest.mark.parametrize(
    ("base", "anchor"), [(DRAFT, "none"), (STANDARD, "straight"), (PAPER, "both")]
)
def test_the_portable_tier_holds_in_what_is_exported(base: Preset, anchor: str) -> None:
    preset = base.for_route("photons", anchor=anchor)
    rungs = portable.students(preset, Disk(), np.random.default_rng(0))  # type: ignore[arg-type]
    assert 1 <= len(rungs) <= len(portable.SHARES)
    largest = max(rungs, key=lambda rung: rung.macs).preset
    model = networks.appearance(Student(LAMP, largest))
    assert tiers.fault(tiers.PORTABLE, model, "appearance") == ""
    sizes = [largest.student_grid, *largest.anchors.values()]
    macs = portable.surface_macs(sizes, largest.student_network, DEGREE)
    assert macs == inspect(model, "appearance").macs_per_sample
    wider = replace(largest.student_network, width=largest.student_network.width + 32)
    assert not portable.fits(sizes, wider, DEGREE)
    sized = next(portable.transparencies(preset))
    model = networks.transparency(Transparency(LAMP, sized))
    assert tiers.fault(tiers.PORTABLE, model, "transparency") == ""


def test_what_samples_a_portable_lamp_is_portable() -> None:
    sized = portable.sampling(STANDARD)
    for network, model in (
        ("sampler", networks.sampler(Sampler(LAMP, sized))),
        ("sampler_pdf", networks.sampler_pdf(Sampler(LAMP, sized))),
        ("fast_map", networks.fast_map(FastMap(LAMP, sized))),
    ):
        assert tiers.fault(tiers.PORTABLE, model, network) == ""
    assert "multiply-adds" in tiers.fault(
        tiers.PORTABLE, networks.sampler(Sampler(LAMP, STANDARD)), "sampler"
    )


def test_square_error_tells_right_from_wrong_through_noise() -> None:
    """One random throughput a line is enough to prefer the network that is its mean."""
    torch.manual_seed(0)
    network = Transparency(LAMP, DRAFT)
    rays = torch.randn(3, 4096, 3)
    rays /= rays.norm(dim=-1, keepdim=True)
    throughput = torch.bernoulli(network(*rays).detach())
    right = square_error(network, (*rays, throughput))
    with torch.no_grad():
        network.network[-1].bias.add_(1.0)
    assert right < square_error(network, (*rays, throughput)) - 0.02
