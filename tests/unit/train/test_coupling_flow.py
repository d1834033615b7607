"""Every coupling flow: inverse, Jacobian, normalisation, floors."""

from __future__ import annotations

import math

import pytest
import torch

from purelight_train.networks.coupling_flow import CouplingFlow, Spline

CONTEXT = 5


def make_flow(couplings: int, bins: int, scale: float) -> CouplingFlow:
    torch.manual_seed(couplings * 100 + bins)
    flow = CouplingFlow(CONTEXT, couplings, 16, 2, bins).double()
    for parameter in flow.parameters():
        parameter.data = torch.randn_like(parameter) * scale
    return flow


@pytest.mark.parametrize("scale", [0.1, 0.3])
@pytest.mark.parametrize("bins", [4, 32])
@pytest.mark.parametrize("couplings", [1, 2, 4])
class TestFlow:
    def test_round_trip(self, couplings: int, bins: int, scale: float) -> None:
        flow = make_flow(couplings, bins, scale)
        u, context = torch.rand(500, 2).double(), torch.randn(500, CONTEXT).double()
        z, log = flow.sample(u, context)
        back, log_back = flow.to_uniform(z, context)
        torch.testing.assert_close(back, u, atol=1e-6, rtol=0)
        torch.testing.assert_close(log_back, log, atol=1e-4, rtol=0)

    def test_density_is_the_jacobian(self, couplings: int, bins: int, scale: float) -> None:
        flow = make_flow(couplings, bins, scale)
        z, context = torch.rand(20, 2).double(), torch.randn(20, CONTEXT).double()
        for i in range(len(z)):
            row = context[i : i + 1]
            jacobian = torch.autograd.functional.jacobian(
                lambda p, row=row: flow.to_uniform(p[None], row)[0][0], z[i]
            )
            log = flow.log_density(z[i : i + 1], row)[0]
            torch.testing.assert_close(torch.linalg.det(jacobian).log(), log, atol=1e-8, rtol=0)

    def test_integral_is_one(self, couplings: int, bins: int, scale: float) -> None:
        """Stratified quadrature with 256² points."""
        flow = make_flow(couplings, bins, scale)
        side = 256
        axis = (torch.arange(side, dtype=torch.float64) + 0.5) / side
        z = torch.stack(torch.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
        context = torch.randn(1, CONTEXT).double().expand(len(z), -1)
        with torch.no_grad():
            total = torch.exp(flow.log_density(z, context)).mean()
        assert float(total) == pytest.approx(1, abs=2e-2 if scale > 0.2 else 1e-3)


@pytest.mark.parametrize("scale", [1.0, 40.0, 120.0])
def test_spline_survives_extreme_logits_in_float32(scale: float) -> None:
    """With the floors, sharp logits give neither NaN nor a wrong inverse (hard case)."""
    torch.manual_seed(3)
    spline = Spline(torch.randn(4000, 65) * scale)
    u = torch.rand(4000)
    u[:4] = torch.tensor([0.0, 1 - 2.0**-24, 1.0, 0.5])
    z, density = spline.inverse(u)
    back, again = spline.forward(z)
    assert torch.isfinite(z).all()
    assert torch.isfinite(density).all()
    assert float(density.min()) > 5e-4
    assert float((back - u).abs().max()) < 2e-4
    assert float((density / again).log().abs().max()) < math.log(1.05)


def test_untrained_flow_is_uniform() -> None:
    flow = CouplingFlow(CONTEXT, 4, 16, 2, 8)
    log = flow.log_density(torch.rand(100, 2), torch.randn(100, CONTEXT))
    torch.testing.assert_close(log, torch.zeros(100), atol=1e-5, rtol=0)
