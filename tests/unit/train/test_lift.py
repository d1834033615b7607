"""A student that looks points up a little above the surface: two sides are two places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from purelight_format.measures import BoundingSphere
from purelight_train.light.description import Description
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import DRAFT, PRESETS, SKETCH, GridSize, MLPSize
from purelight_train.sizes.ladder import touched, unit_points

LAMP = Description(
    BoundingSphere((1.0, 2.0, 3.0), 0.5), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 1.0,
    (True, True, True), 1.0, 1,
)  # fmt: skip
SMALL = replace(SKETCH, student_grid=GridSize(2, 2, 4, 16, 1 << 12), student_network=MLPSize(16, 1))
SHADED = """<scene version="3.0.0">
  <shape type="sphere"><float name="radius" value="0.02"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="300,200,100"/></emitter></shape>
  <shape type="cylinder"><float name="radius" value="0.1"/>
    <point name="p0" x="0" y="0" z="-0.1"/><point name="p1" x="0" y="0" z="0.1"/>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
</scene>"""


class Shades:
    """Four thin cylinders, of which either side is seen."""

    sphere = LAMP.sphere

    def sample(self, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        angle, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-0.2, 0.2, count)
        away = np.stack((np.cos(angle), np.sin(angle), 0 * angle), 1)
        axes = 0.2 * np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]])
        position = self.sphere.center + axes[rng.integers(4, size=count)] + 0.15 * away
        position += height[:, None] * [0, 0, 1]
        return position, np.where(rng.random((count, 1)) < 0.5, -away, away)


@pytest.mark.slow
def test_the_outside_of_a_thin_shade_is_dark(mitsuba: Any, tmp_path: Path) -> None:
    """After the few steps of a sketch, in which few rays were asked on the outside."""
    from purelight_train.runs.pipeline import start

    (tmp_path / "lamp.xml").write_text(SHADED)
    ray = torch.tensor([[0.1, 0.0, 0.0]]), torch.tensor([[1.0, 0, 0]]), torch.tensor([[1.0, 0, 0]])
    inside = ray[0], -ray[1], torch.tensor([[-0.8, 0.0, 0.6]])
    found = []
    for lift in (0.0, SKETCH.lift):
        student = start(
            tmp_path / "lamp.xml", tmp_path / str(lift), replace(SKETCH, lift=lift), 0, "cpu",
            resume=False, route="photons",
        ).student  # fmt: skip
        with torch.no_grad():
            found.append(float(student(*ray).mean() / student(*inside).mean()))
    assert found[1] < 0.1 * found[0]


@pytest.mark.parametrize("lift", [0.0, 0.06])
def test_places_stay_in_the_cube(lift: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even of points on the bounding sphere, whose normals point away from it."""
    student = Student(LAMP, replace(SMALL, lift=lift))
    seen: list[Tensor] = []
    monkeypatch.setattr(
        student.grid, "forward", lambda x: seen.append(x) or x.new_zeros(len(x), student.grid.size)
    )
    normal = torch.cat((torch.eye(3), -torch.eye(3)))
    centre = torch.tensor(LAMP.sphere.center)
    student(centre + LAMP.sphere.radius * normal, normal, normal)
    (place,) = seen
    torch.testing.assert_close(place, 0.5 + 0.5 * normal)
    student(centre + 0 * normal, normal, normal)
    torch.testing.assert_close(seen[1], 0.5 + 0.5 * lift / (1 + lift) * normal)


def test_light_that_passes_a_lamp_knows_no_sides() -> None:
    assert Transparency(LAMP, replace(SMALL, lift=0.06)).lift == 0


def test_sizes_count_the_places_that_are_looked_up() -> None:
    counts = [
        touched(unit_points(Shades(), np.random.default_rng(0), lift), 32)  # type: ignore[arg-type]
        for lift in (0.0, 0.06)
    ]
    assert 1.3 * counts[0] < counts[1] < 2.1 * counts[0]


def test_runs_of_before_have_none() -> None:
    for preset in PRESETS.values():
        assert type(preset).from_dict(preset.to_dict()).lift == preset.lift
    older = {k: v for k, v in DRAFT.to_dict().items() if k != "lift"}
    assert type(DRAFT).from_dict(older).lift == 0
