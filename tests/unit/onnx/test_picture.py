"""Picture files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from purelight_format.srgb import png
from purelight_onnx.picture import write_exr


@pytest.mark.parametrize(("half", "tolerance"), [(False, 0.0), (True, 1e-3)])
def test_exr_keeps_the_picture(tmp_path: Path, half: bool, tolerance: float) -> None:
    image = np.random.default_rng(0).random((5, 7, 3)).astype(np.float32) * 100
    write_exr(tmp_path / "view.exr", image, half=half)
    with OpenEXR.File(str(tmp_path / "view.exr")) as file:
        pixels = file.channels()["RGB"].pixels
        assert pixels.dtype == (np.float16 if half else np.float32)
        np.testing.assert_allclose(pixels, image, rtol=tolerance)
    assert [p.name for p in tmp_path.iterdir()] == ["view.exr"]


def test_half_floats_saturate_instead_of_overflowing(tmp_path: Path) -> None:
    write_exr(tmp_path / "view.exr", np.full((2, 2, 3), 1e6, np.float32), half=True)
    with OpenEXR.File(str(tmp_path / "view.exr")) as file:
        assert (file.channels()["RGB"].pixels == 65504).all()


@pytest.mark.parametrize("power", [1e-6, 1.0, 1e6])
def test_the_preview_exposes_any_power_alike(power: float) -> None:
    image = np.random.default_rng(0).random((32, 32, 3)).astype(np.float32)
    pixels = np.asarray(Image.open(io.BytesIO(png(image * np.float32(power)))), np.int64)
    expected = np.asarray(Image.open(io.BytesIO(png(image))), np.int64)
    assert np.abs(pixels - expected).max() <= 1
    assert pixels.max() > 200


def test_a_black_picture_is_black() -> None:
    pixels = np.asarray(Image.open(io.BytesIO(png(np.zeros((4, 4, 3), np.float32)))))
    assert not pixels.any()


def test_a_stop_doubles_faint_light() -> None:
    image = np.full((1, 1, 3), 1e-3, np.float32)
    one, two = (np.asarray(Image.open(io.BytesIO(png(image, stops)))) for stops in (0.0, 1.0))
    assert two[0, 0, 0] == pytest.approx(2 * one[0, 0, 0], abs=3)
