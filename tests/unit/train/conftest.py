"""Fixtures of the training tests: Mitsuba, and the smallest lamp that has every part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch

LAMP = """<scene version="3.0.0">
  <shape type="sphere"><float name="radius" value="0.01"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>
  <shape type="sphere"><float name="radius" value="0.05"/>
    <bsdf type="roughdielectric"><float name="alpha" value="0.3"/>
      <float name="int_ior" value="1.5"/></bsdf></shape>
  <shape type="sphere"><float name="radius" value="0.045"/>
    <boolean name="flip_normals" value="true"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf></shape>
</scene>"""


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    from purelight_mitsuba import platform

    torch.set_num_threads(2)
    return platform.use("llvm_ad_rgb")


@pytest.fixture(scope="session")
def lamp(mitsuba: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A red-heavy sphere in a rough glass shell."""
    path = tmp_path_factory.mktemp("lamp") / "lamp.xml"
    path.write_text(LAMP.format(radiance="300,200,100"))
    return path
