"""Spots of Mitsuba's scenes and of glTF: each with the falloff of its format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.importing import read_lamp
from purelight_import.model.lamp import Lamp
from purelight_import.parts.emitters import flux
from purelight_import.parts.points import spot_solid_angle

pytestmark = pytest.mark.usefixtures("at_once")
SPOT = (
    '<emitter type="spot" id="spot"><rgb name="intensity" value="10, 5, 1"/>{inner}</emitter>'
    '<shape type="sphere"><point name="center" x="0" y="0" z="3"/></shape>'
)
ANGLES = '<float name="beam_width" value="{}"/><float name="cutoff_angle" value="{}"/>'
PICTURE = '<texture type="bitmap" name="texture"><string name="filename" value="p.png"/></texture>'
RAYS = 1 << 20


def spot(folder: Path, inner: str) -> Path:
    path = folder / "shelf.xml"
    path.write_text(f'<scene version="3.0.0">{SPOT.format(inner=inner)}</scene>')
    return path


def power(lamp: Lamp) -> np.ndarray:
    """Of the part that shines, in W per channel."""
    (part,) = [p for p in lamp.parts if p.radiance is not None]
    return np.array(flux(part, part.radiance))


def emitted(mi: Any, path: Path) -> np.ndarray:
    """Power that Mitsuba sends out, in W per channel."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, RAYS)
    (emitter,) = mi.load_file(str(path)).emitters()
    numbers = sampler.next_1d(), sampler.next_2d(), sampler.next_2d()
    _, weight = emitter.sample_ray(0.0, *numbers)
    return np.array(weight, np.float64).mean(1)


@pytest.mark.parametrize(("beam", "cutoff"), [(15, 20), (0, 20), (20, 60), (59.9, 60), (20, 20)])
def test_a_spot_has_the_power_that_mitsuba_gives_it(
    beam: float, cutoff: float, mitsuba: Any, tmp_path: Path
) -> None:
    path = spot(tmp_path, ANGLES.format(beam, cutoff))
    lamp, _ = read_lamp(path)
    np.testing.assert_allclose(power(lamp), emitted(mitsuba, path), rtol=3e-3)
    assert len(lamp.notes.lines()) == 1


def test_the_picture_of_a_spot_dims_it_and_is_noted(mitsuba: Any, tmp_path: Path) -> None:
    pixels = np.full((8, 8, 3), 255, np.uint8)
    pixels[:, :4], pixels[:3, :, 1] = 0, 0
    Image.fromarray(pixels).save(tmp_path / "p.png")
    path = spot(tmp_path, ANGLES.format(10, 40) + PICTURE)
    lamp, _ = read_lamp(path)
    np.testing.assert_allclose(power(lamp), emitted(mitsuba, path), rtol=0.01)
    (line,) = [line for line in lamp.notes.lines() if "spot's picture" in line]
    assert line.endswith("(spot)")


def test_the_falloff_of_gltf_is_a_square() -> None:
    """By its integral over the cosine, which is a cube's."""
    inner, outer = 0.3, 0.6
    width = np.cos(inner) - np.cos(outer)
    wanted = 2 * np.pi * (1 - np.cos(inner) + width / 3)
    assert spot_solid_angle(inner, outer) == pytest.approx(wanted, rel=1e-3)
    assert spot_solid_angle(0.6, 0.6) == pytest.approx(2 * np.pi * (1 - np.cos(0.6)), rel=1e-6)
