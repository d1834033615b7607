"""The fast map: its loss is least at the mean light of each cell; its level and shape."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.student import MAX_LOG
from purelight_train.presets import DRAFT

CELLS = 256
LAMP = Description(
    BoundingSphere((0.0, 0.0, 0.0), 1.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0), 2.0,
    (True, True, False), 1.0, 1,
)  # fmt: skip


def fast_map() -> FastMap:
    torch.manual_seed(0)
    return FastMap(LAMP, DRAFT)


def test_least_at_the_mean_of_noisy_cells(monkeypatch: Any) -> None:
    """Samples that are bright once in ten: neither their median nor a lesser value wins."""
    network, rng = fast_map(), np.random.default_rng(0)
    level = torch.tensor([1.0, 1e-2])[:, None, None]  # A bright view and a dim one.
    shape = (1 << 9, 2, CELLS, 3)
    sample = (torch.from_numpy(rng.random(shape)) < 0.1).float() * 20 * level
    value = torch.nn.Parameter(torch.full((2, CELLS, 3), 0.0))
    monkeypatch.setattr(network, "value", lambda point, most: torch.exp(value))
    adam, point = torch.optim.Adam([value], lr=2e-2), torch.zeros(2, 3)
    for step in range(1500):
        adam.param_groups[0]["lr"] = 2e-2 * (1 - step / 1500)
        adam.zero_grad()
        network.loss(point, sample[step % len(sample)]).backward()
        adam.step()
    found = torch.exp(value.detach()) * network.scale
    for view, true in zip(found, (2.0, 0.02), strict=True):
        np.testing.assert_allclose(view[:, :2].mean(), true, rtol=0.02)
        np.testing.assert_allclose(view[:, :2].reshape(-1, 8).mean(1), true, rtol=0.5)


def test_channels_without_light_are_not_learned() -> None:
    network = fast_map()
    point = torch.randn(4, 3) + 3
    radiance = torch.rand(4, CELLS, 3)
    spoilt = radiance * torch.tensor([1.0, 1.0, 50.0])
    assert network.loss(point, radiance).item() == network.loss(point, spoilt).item()


@pytest.mark.parametrize("one_hot", [False, True])
def test_shape_does_not_change_the_sum_and_level_nothing_else(one_hot: bool) -> None:
    torch.manual_seed(0)
    network = FastMap(LAMP, replace(DRAFT, fast_map_one_hot=one_hot))
    point = 3 * torch.nn.functional.normalize(torch.randn(8, 3), dim=-1)
    last = network.network[-1]
    assert isinstance(last, torch.nn.Linear)

    @torch.no_grad()
    def changed(first: int, by: torch.Tensor) -> torch.Tensor:
        before = last.bias.clone()
        last.bias[first : first + len(by)] += by
        value = network.brightness(network.value(point, MAX_LOG))[..., 0]
        last.bias.copy_(before)
        return value

    as_it_is = changed(0, torch.zeros(1))
    spread = changed(0, torch.randn(CELLS))
    assert (spread / as_it_is - 1).abs().mean() > 0.3
    torch.testing.assert_close(spread.mean(1), as_it_is.mean(1))
    torch.testing.assert_close(changed(0, torch.ones(CELLS)), as_it_is)
    raised = changed(len(last.bias) - 1, torch.ones(1))
    torch.testing.assert_close(raised, np.e * as_it_is)
