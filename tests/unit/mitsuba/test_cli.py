"""purelight-render: pictures, and one line for every fault a user can make."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from purelight_mitsuba.cli import main
from purelight_mitsuba.output import passes
from tests.support import analytic_lamps as lamps
from tests.support.verdicts import FINE

SCENE = """<scene version="3.0.0">{integrator}
<sensor type="perspective"><transform name="to_world">
<lookat origin="2, 1, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
<sampler type="independent"><integer name="sample_count" value="2"/></sampler></sensor>
<emitter type="purelight"><string name="filename" value="ball.plux"/></emitter>
<shape type="rectangle"><transform name="to_world"><translate z="-0.5"/></transform></shape></scene>
"""
LAMP = '<emitter type="purelight"><string name="filename" value="ball.plux"/></emitter>'
FAST = '<integrator type="purelight"><string name="mode" value="fast"/></integrator>'


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    lamps.ball().write(tmp_path / "ball.plux")
    path = tmp_path / "scene.xml"
    path.write_text(SCENE.format(integrator=FAST))
    return path


def picture(path: Path) -> np.ndarray:
    with OpenEXR.File(str(path)) as file:
        return file.channels()["RGB"].pixels


def test_writes_both_pictures(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = scene.with_name("out.exr")
    assert main([str(scene), "--output", str(output)]) == 0
    assert picture(output).shape == (16, 24, 3)
    assert picture(output).max() > 1
    assert output.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    assert "2 samples per pixel, fast" in capsys.readouterr().out


def test_fast_mode_warns_where_the_maker_advises_against_it(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once for a bundle, and not in accurate mode, nor for a lamp that is good at it."""
    assert FINE.fast is not None
    bad = replace(FINE, fast=replace(FINE.fast, within=0.4))
    scene.write_text(SCENE.replace("<shape type", f"{LAMP}<shape type").format(integrator=FAST))
    for verdict, mode, count in ((bad, "fast", 1), (bad, "accurate", 0), (FINE, "fast", 0)):
        ball = replace(lamps.ball(), fidelity={"verdict": verdict.to_json()})
        ball.write(scene.with_name("ball.plux"))
        output = str(scene.with_name("out.exr"))
        assert main([str(scene), "--output", output, "--mode", mode]) == 0
        lines = [x for x in capsys.readouterr().err.splitlines() if "warning: ball.plux" in x]
        assert len(lines) == count
        assert all("fast mode: not recommended" in x and "within ±40 %" in x for x in lines)


def test_a_missing_folder_is_made(scene: Path) -> None:
    output = scene.parent / "new" / "folder" / "out.exr"
    assert main([str(scene), "--output", str(output)]) == 0
    assert output.is_file()


def test_arguments_override_the_scene(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = str(scene.with_name("out.exr"))
    assert main([str(scene), "--output", output, "--mode", "accurate", "--spp", "3"]) == 0
    assert "3 samples per pixel, accurate" in capsys.readouterr().out


def test_layers_lie_beside_the_picture(scene: Path) -> None:
    output = scene.with_name("out.exr")
    assert main([str(scene), "--output", str(output), "--aovs", "--width", "12"]) == 0
    with OpenEXR.File(str(output)) as file:
        channels = dict(file.channels())
        shape = channels["depth.Z"].pixels.shape
    assert set(channels) == {"RGB", "albedo", "normal.X", "normal.Y", "normal.Z", "depth.Z"}
    assert shape == (8, 12)


def test_light_groups_lie_beside_the_picture(scene: Path) -> None:
    output = scene.with_name("out.exr")
    assert main([str(scene), "--output", str(output), "--light-groups", "--spp", "9"]) == 0
    with OpenEXR.File(str(output)) as file:
        layers = {name: channel.pixels for name, channel in file.channels().items()}
    whole = layers.pop("RGB")
    assert sorted(layers) == ["light.ball", "light.others"]
    np.testing.assert_allclose(sum(layers.values()), whole, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("integrator", ["", '<integrator type="path"/>'])
def test_other_integrators_are_replaced(scene: Path, integrator: str) -> None:
    scene.write_text(SCENE.format(integrator=integrator))
    output = scene.with_name("out.exr")
    assert main([str(scene), "--output", str(output)]) == 0
    assert picture(output).max() > 1


def test_what_another_integrator_says_is_kept_or_told(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its depth, what it hides, and purelight itself within it."""
    depth = '<integer name="max_depth" value="1"/>'
    ours = f'<integrator type="purelight">{depth}</integrator>'
    nested = f'<integrator type="aov"><string name="aovs" value="d:depth"/>{ours}</integrator>'
    output, pictures, told = scene.with_name("out.exr"), [], []
    for text in (ours, f'<integrator type="path">{depth}</integrator>', nested,
                 f'<integrator type="volpath">{depth}</integrator>'):  # fmt: skip
        scene.write_text(SCENE.format(integrator=text))
        assert main([str(scene), "--output", str(output), "--spp", "4"]) == 0
        pictures.append(picture(output))
        lines = capsys.readouterr().err.splitlines()
        told.append([line for line in lines if line.startswith("purelight-render: warning")])
    for other in pictures[1:]:
        np.testing.assert_allclose(other, pictures[0], rtol=1e-5, atol=1e-7)
    assert [len(lines) for lines in told] == [0, 0, 1, 1]
    assert "AOVIntegrator" in told[2][0]


def test_a_film_with_alpha_keeps_it(scene: Path) -> None:
    text = SCENE.format(integrator="")
    wanted = '<film type="hdrfilm"><string name="pixel_format" value="rgba"/>'
    assert '<film type="hdrfilm">' in text
    scene.write_text(text.replace('<film type="hdrfilm">', wanted))
    output = scene.with_name("out.exr")
    assert main([str(scene), "--output", str(output)]) == 0
    with OpenEXR.File(str(output)) as file:
        pixels = file.channels()["RGBA"].pixels
    assert pixels.shape[-1] == 4
    assert (pixels[..., 3].min(), pixels[..., 3].max()) == (0, pytest.approx(1))


def test_seeds_and_passes(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    output = scene.with_name("out.exr")

    def render(seed: int) -> np.ndarray:
        command = [str(scene), "--output", str(output), "--spp", "7", "--seed", str(seed)]
        assert main(command) == 0
        return picture(output)

    np.testing.assert_allclose(render(1), render(1), rtol=1e-4)  # Sums in any order.
    assert np.abs(render(1) - render(2)).max() > 0.01
    whole = render(1).mean()
    monkeypatch.setattr(passes, "SAMPLES", 24 * 16 * 3)
    assert (parts := render(1)).shape == (16, 24, 3)
    assert parts.mean() == pytest.approx(whole, rel=0.1)


def fault(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The single line that a command prints before it fails with exit code 2."""
    assert main(arguments) == 2
    printed = capsys.readouterr().err.splitlines()
    bar = ("spp/s", "s/spp")  # Of a quick machine, and of a slow one.
    lines = [line for line in printed if line and not any(unit in line for unit in bar)]
    assert len(lines) == 1
    assert lines[0].startswith("purelight-render: error: ")
    return lines[0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<scene version", "<scene versio", "version"),
        ("</scene>", "", "Parsing of XML"),
        (SCENE.format(integrator=FAST), "no xml", "Parsing of XML"),
        (SCENE.format(integrator=FAST), '<shape version="3.0.0" type="sphere"/>', "not a scene"),
        ("ball.plux", "bull.plux", "bull.plux: no such file"),
        ("ball.plux", "scene.xml", "not a valid bundle"),
        ("rectangle", "rectangel", "rectangel"),
        ('value="fast"', 'value="quick"', "neither accurate nor fast"),
        (
            'value="ball.plux"/>',
            'value="ball.plux"/><transform name="to_world"><scale x="2"/></transform>',
            "shears or scales",
        ),
    ],
)
def test_faults_in_a_scene(
    scene: Path, old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    scene.write_text(scene.read_text().replace(old, new))
    output = scene.with_name("out.exr")
    assert message in fault([str(scene), "--output", str(output)], capsys)
    assert not output.exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--output", "/dev/null/at/all.exr"], "cannot write"),
        (["--output", "picture.jpg"], ".exr"),
        (["--spp", "0"], "--spp"),
        (["--variant", "cuda_mono"], "variant cuda_mono"),
    ],
)
def test_faults_in_the_arguments(
    scene: Path, change: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = scene.with_name("out.exr")
    assert message in fault([str(scene), "--output", str(output), *change], capsys)


@pytest.mark.parametrize("seed", ["-1", "4294967296"])
def test_a_seed_is_checked_before_anything_is_drawn(
    scene: Path, seed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = scene.with_name("out.exr")
    with pytest.raises(SystemExit, match="2"):
        main([str(scene), "--output", str(output), "--aovs", "--seed", seed])
    assert "--seed" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "message"), [("none.xml", "no such file"), ("a.txt", ".xml")])
def test_faults_in_the_name_of_the_scene(
    tmp_path: Path, name: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").touch()
    output = str(tmp_path / "out.exr")
    assert message in fault([str(tmp_path / name), "--output", output], capsys)


def test_a_newer_bundle_says_so(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bundle = scene.with_name("ball.plux")
    data = bundle.read_bytes()
    bundle.write_bytes(data.replace(b'"format_version": "1.0"', b'"format_version": "9.0"'))
    if bundle.read_bytes() == data:
        bundle.write_bytes(data.replace(b'"format_version":"1.0"', b'"format_version":"9.0"'))
    assert bundle.read_bytes() != data
    fault([str(scene), "--output", str(scene.with_name("out.exr"))], capsys)


def test_a_full_disk_leaves_no_picture(
    scene: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("purelight_format.atomic.os.fsync", full)
    output = scene.with_name("out.exr")
    assert "No space left" in fault([str(scene), "--output", str(output)], capsys)
    assert sorted(path.name for path in scene.parent.iterdir()) == ["ball.plux", "scene.xml"]
