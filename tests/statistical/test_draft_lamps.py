"""Lamps trained at `draft` against what no network made; minutes each, so marked slow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.support import fidelity
from tests.support.trained import prepare

pytestmark = pytest.mark.slow
RUNS = [("frosted_globe", "photons"), ("frosted_globe", "teacher"), ("filament_bulb", "photons")]


@pytest.fixture(scope="module", params=RUNS, ids="-".join)
def subject(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    lamp, route = request.param
    return prepare(lamp, tmp_path_factory.mktemp("draft"), "draft", route, threads=2)


def test_flux_closes(subject: Any) -> None:
    """Student over surface and hemisphere within 3% per channel; the IES file within 1%."""
    figures = fidelity.flux(subject)
    np.testing.assert_allclose(figures["student_over_traced"], 1, atol=0.03)
    assert figures["ies_over_traced"] == pytest.approx(1, abs=0.01)


def test_light_on_the_floor(subject: Any) -> None:
    """Rendered irradiance 1 m below against light tracing, in both modes."""
    figures = fidelity.irradiance(subject)
    assert figures["truth_noise"] < 0.02
    for mode, absolute, mean in (("accurate", 0.10, 0.02), ("fast", 0.15, 0.05)):
        assert figures[mode]["mean_absolute_over_mean"] < absolute, figures
        assert abs(figures[mode]["mean"]) < mean, figures


def test_look_of_the_lamp(subject: Any) -> None:
    """Student and teacher through a thin lens against the light-traced truth, three views."""
    # Light behind clear glass has to be caught, so its truth is noisier
    bar, paths = (0.25, 1 << 24) if "frosted" in subject.scene.name else (0.8, 1 << 26)
    figures = fidelity.appearance(subject, paths=paths)
    student = figures["student_truth"]
    assert student["mape_of_reference"] < 0.15
    assert student["mape_without_noise"] < bar
    assert abs(student["mean"]) < 0.05
    if subject.teacher is not None:
        assert figures["teacher_truth"]["mape_without_noise"] < bar


def test_sampler(subject: Any) -> None:
    figures = fidelity.sampler(subject)
    assert figures["integral_error"] < 1e-3
    assert figures["chi_square_least_p"] > figures["chi_square_threshold"]
    assert figures["variance_factor_least"] > 2


def test_mitsuba_and_onnx_runtimes_agree(subject: Any) -> None:
    figures = fidelity.hosts(subject)
    assert max(figures[k] for k in ("appearance", "transparency", "fast_map")) < 1e-4
