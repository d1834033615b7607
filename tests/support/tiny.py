"""The smallest lamp that has every part, and a preset that trains it in no time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from purelight_train.presets import DRAFT, FlowSize, GridSize, MLPSize, Optimisation, Preset

LAMP = """<scene version="3.0.0">
  <shape type="sphere"><float name="radius" value="0.01"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="300,200,100"/></emitter></shape>
  <shape type="sphere"><float name="radius" value="0.05"/>
    <bsdf type="roughdielectric"><float name="alpha" value="0.3"/>
      <float name="int_ior" value="1.5"/></bsdf></shape>
  <shape type="sphere"><float name="radius" value="0.045"/>
    <boolean name="flip_normals" value="true"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf></shape>
</scene>"""

TINY = replace(
    DRAFT,
    name="tiny",
    paths=1 << 20,
    density_neighbours=100,
    teacher_grid=GridSize(2, 2, 4, 8, 1 << 10),
    teacher_flow=FlowSize(2, MLPSize(16, 2), 8),
    teacher=Optimisation(60, 1 << 11, 1e-2),
    distillation_samples=1 << 17,
    student_grid=GridSize(2, 2, 4, 8, 1 << 10),
    student_network=MLPSize(16, 2),
    student=Optimisation(150, 1 << 11, 1e-2),
    transparency_samples=1 << 14,
    transparency=Optimisation(30, 1 << 10, 1e-2),
    cap_points=1 << 8,
    sampler=Optimisation(30, 1 << 10, 1e-2),
    fast_map=Optimisation(30, 1 << 5, 1e-2),
    photons=Optimisation(400, 1 << 11, 1e-2),
)


def write(folder: Path) -> Path:
    """The lamp's scene: a red-heavy sphere in a rough glass shell."""
    path = folder / "lamp.xml"
    path.write_text(LAMP)
    return path


def train(lamp: Path, output: Path, preset: Preset = TINY, **options: Any) -> dict[str, Any]:
    """Trains a lamp; gives its metrics, without a verdict unless `judged`."""
    from purelight_train.runs.pipeline import start

    judged = options.pop("judged", False)
    return start(lamp, output, preset, 0, "cpu", **{"resume": False, **options})(judged=judged)
