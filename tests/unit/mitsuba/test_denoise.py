"""Denoised pictures: nearer to the truth, edges kept, light groups still adding up."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.cli import main
from purelight_mitsuba.output import denoise
from purelight_mitsuba.usd_scene import load_usd
from tests.support.usd_stages import FLOOR, stage

SIZE = 96


def scene() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A picture of two walls that meet, striped on the right, and what is seen first."""
    x, y = np.meshgrid(np.linspace(0, 1, SIZE), np.linspace(0, 1, SIZE))
    right = (x > 0.5)[..., None]
    stripes = (np.sin(60 * y) > 0)[..., None]
    albedo = np.where(right & stripes, [0.8, 0.2, 0.1], [0.5, 0.5, 0.5])
    normal = np.where(right, [-1.0, 0, 0], [0, 0, 1.0])
    light = np.where(right, 3.0, 1.0) * (0.3 + y[..., None])
    return albedo * light, {"albedo": albedo, "normal": normal}


def noisy(image: np.ndarray, seed: int = 0) -> np.ndarray:
    return image * np.random.default_rng(seed).gamma(2, 1 / 2, image.shape)


def error(image: np.ndarray, truth: np.ndarray) -> float:
    return float((np.abs(image - truth) / truth).mean())


def test_a_denoised_picture_is_nearer_to_the_truth() -> None:
    truth, seen = scene()
    before = noisy(truth)
    after = denoise.denoise(before, seen)
    assert after.shape == truth.shape
    assert error(after, truth) < 0.2 * error(before, truth)
    blind = denoise.denoise(before, {name: np.zeros_like(a) for name, a in seen.items()})
    assert error(after, truth) < 0.7 * error(blind, truth)  # The layers tell where stripes are.


def test_light_groups_still_add_up() -> None:
    truth, seen = scene()
    groups = {"light.a": noisy(0.3 * truth, 1), "light.b": noisy(0.7 * truth, 2)}
    image, clean = denoise.denoised(sum(groups.values()), groups, seen)
    np.testing.assert_allclose(sum(clean.values()), image, rtol=1e-6)
    assert error(clean["light.b"], 0.7 * truth) < 0.3 * error(groups["light.b"], 0.7 * truth)
    assert denoise.denoised(truth, {}, seen)[1] == {}


def test_spoilt_pixels_do_not_spread() -> None:
    truth, seen = scene()
    spoilt = noisy(truth)
    spoilt[40, 40] = np.nan
    spoilt[20, 70] = np.inf
    assert error(denoise.denoise(spoilt, seen), truth) < 0.2 * error(noisy(truth), truth)


ROOM = """<scene version="3.0.0">
  <integrator type="purelight"/>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world">
      <lookat origin="0, -4, 1" target="0, 0, 0.5" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><rfilter type="box"/>
      <integer name="width" value="64"/><integer name="height" value="64"/></film>
  </sensor>
  <shape type="rectangle"><transform name="to_world"><scale value="4"/></transform>
    <bsdf type="diffuse"/></shape>
  <shape type="cube"><transform name="to_world"><scale value="0.4"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.2, 0.2"/></bsdf></shape>
  <shape type="sphere"><point name="center" x="1" y="-1" z="2.5"/><float name="radius" value="1.2"/>
    <emitter type="area"><rgb name="radiance" value="5, 5, 5"/></emitter></shape>
</scene>
"""


def test_the_command_takes_noise_away(tmp_path: Path) -> None:
    (tmp_path / "room.xml").write_text(ROOM)
    pictures = {}
    for name, more in (("truth", ["--spp", "512"]), ("noisy", []), ("clean", ["--denoise"])):
        words = ["--spp", "2", "--seed", "7", *more]
        output = tmp_path / f"{name}.exr"
        assert main([str(tmp_path / "room.xml"), "--output", str(output), *words]) == 0
        pictures[name] = np.array(mi.Bitmap(str(output)))
    lit = pictures["truth"] > 0.05
    truth, before, after = (pictures[name][lit] for name in ("truth", "noisy", "clean"))
    assert error(after, truth) < 0.5 * error(before, truth)


def test_a_filter_that_spreads_noise_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, kind in (("box", "box"), ("soft", "gaussian")):
        text = ROOM.replace('rfilter type="box"', f'rfilter type="{kind}"')
        (tmp_path / f"{name}.xml").write_text(text)
        words = [str(tmp_path / f"{name}.xml"), "--output", str(tmp_path / f"{name}.exr")]
        assert main([*words, "--spp", "1", "--width", "16", "--denoise"]) == 0
        lines = [x for x in capsys.readouterr().err.splitlines() if "warning" in x]
        assert len(lines) == (name == "soft"), lines
        assert all('<rfilter type="box"/>' in line for line in lines)


def test_a_stage_gets_the_filter_that_is_asked_for(tmp_path: Path) -> None:
    path = stage(tmp_path, FLOOR, 'def SphereLight "Light"\n{\n}\n')
    for kind in ("box", "gaussian"):
        film = load_usd(path, pixel_filter=kind).scene.sensors()[0].film()
        assert film.rfilter().is_box_filter() == (kind == "box")


def test_without_the_library_there_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(denoise, "_library", lambda: None)
    (tmp_path / "room.xml").write_text(ROOM)
    output = tmp_path / "o.exr"
    assert main([str(tmp_path / "room.xml"), "--output", str(output), "--denoise"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert 'pip install "purelight[denoise]"' in line
    assert not output.exists()


def test_the_library_brings_no_pytorch() -> None:
    script = (
        "import sys; from purelight_mitsuba import use; use()\n"
        "from purelight_mitsuba.output import denoise\n"
        "assert denoise._library() is not None and 'torch' not in sys.modules\n"
        "import importlib.util; assert importlib.util.find_spec('torch')\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
