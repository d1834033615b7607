"""Rivals that are trained, on a matt sphere and in next to no time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.distilled import Distilled
from benchmarks.systems.rivals.histogram import Histogram
from benchmarks.systems.rivals.ncl import Ncl, NclLightTraced
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem
from benchmarks.systems.rivals.shells import Shell4D, ShellFactorised
from benchmarks.systems.rivals.teacher import Teacher
from benchmarks.systems.rivals.wcl.system import Wcl
from purelight_export.export import export
from purelight_format.bundle import Bundle
from tests.support import tiny
from tests.unit.benchmarks import rival_floor
from tests.unit.benchmarks.rival_floor import CENTRE, RADIANCE, RADIUS, Floor

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """The sphere, trained and exported."""
    made = rival_floor.subject(tmp_path_factory.mktemp("rivals"))
    preset = replace(tiny.TINY, name="test")  # or the benchmark's own `tiny` would be meant
    tiny.train(made.scene, made.run, preset)
    export(made.run, made.bundle)
    return made


@pytest.mark.parametrize(
    "system",
    [Ncl(), NclLightTraced(), Wcl(), Shell4D(), ShellFactorised(), Distilled(), Histogram()],
    ids=lambda system: system.name,
)
def test_floor_under_a_sphere(system: BundleSystem, subject: Subject, tmp_path: Path) -> None:
    if system.name == "wcl":
        pytest.importorskip("pywt", reason="PyWavelets is not installed")
    cost = system.prepare(subject, tmp_path)
    assert cost.seconds > 0
    assert cost.megabytes > 0
    written = (tmp_path / BUNDLE).stat().st_mtime_ns
    assert system.prepare(subject, tmp_path) == cost
    assert (tmp_path / BUNDLE).stat().st_mtime_ns == written
    sphere = Bundle.open(tmp_path / BUNDLE).manifest.bounding_sphere
    assert np.allclose(sphere.center, CENTRE, atol=0.01)
    assert sphere.radius < 1.8 * RADIUS
    (frame,) = system.rendered(subject, Floor(), tmp_path, [64], 0)
    truth = Floor().truth()
    bright = truth.sum(-1) > 0.2 * truth.sum(-1).max()
    ratio = frame.image[bright].mean(0) / truth[bright].mean(0)
    assert np.abs(ratio - 1).max() < 0.1


@dataclass(frozen=True)
class View(Floor):
    """The lamp alone from above."""

    name: str = "view"
    kind: str = "appearance"

    @property
    def empty(self) -> str:
        """A camera that looks at the origin."""
        head = super().empty.split("<shape")[0]
        return head.replace("0, -0.6, -0.1", "0, -0.3, 0.3").replace("-0.5", "0") + "</scene>"


def test_the_teacher_seen(subject: Subject, tmp_path: Path) -> None:
    system = Teacher()
    cost = system.prepare(subject, tmp_path)
    assert cost.megabytes > 1  # photons
    first, second = system.frames(subject, View(), tmp_path, [1, 4], 0)
    assert (first.samples, second.samples) == (1, 4)
    middle = second.image[5, 6]
    assert np.allclose(middle, RADIANCE, rtol=0.25)
    assert (second.image[0, 0] == 0).all()
