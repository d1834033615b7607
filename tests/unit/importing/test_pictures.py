"""Pictures of all kinds: values as they are in the file, and one line for what is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from purelight_format.errors import PureLightError
from purelight_import.importing import Options, read_lamp
from purelight_import.model import limits
from purelight_import.model.material import Material
from purelight_import.model.picture import Picture
from purelight_import.read import images
from purelight_onnx.picture import write_exr

VALUES = np.linspace(0, 4, 2 * 3 * 3, dtype=np.float32).reshape(2, 3, 3)
LAMP = """mtllib lamp.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
usemtl Shade
f 1/1 2/2 3/3
usemtl Glow
f 1/1 2/2 4/3
"""


def pfm(pixels: np.ndarray) -> bytes:
    height, width = pixels.shape[:2]
    return b"PF\n%d %d\n-1.0\n" % (width, height) + pixels[::-1].astype("<f4").tobytes()


def radiance(pixels: np.ndarray) -> bytes:
    """Bytes of mantissas and an exponent for each pixel, not run-length encoded."""
    height, width = pixels.shape[:2]
    exponent = np.ceil(np.log2(np.maximum(pixels.max(-1, keepdims=True), 1e-9) * 1.01))
    mantissa = np.floor(pixels / 2.0**exponent * 256)
    data = np.concatenate((mantissa, exponent + 128), -1).astype(np.uint8)
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width)
    return head + data.tobytes()


def lamp(folder: Path, shade: str, glow: str) -> tuple[Material, Picture, list[str]]:
    (folder / "lamp.mtl").write_text(
        f"newmtl Shade\nKd 1 1 1\nmap_Kd {shade}\nnewmtl Glow\nKd 0 0 0\nKe 1 1 1\nmap_Ke {glow}\n"
    )
    (folder / "lamp.obj").write_text(LAMP)
    read, _ = read_lamp(folder / "lamp.obj", Options(units="m", up="z"))
    parts = {part.material.name: part for part in read.parts}
    material, light = parts["Shade"].material, parts["Glow"].radiance
    assert isinstance(material, Material)
    assert isinstance(light, Picture)
    return material, light, read.notes.lines()


def test_high_ranges_are_linear_and_kept(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", VALUES)
    files = {"a.exr": (tmp_path / "a.exr").read_bytes(), "a.pfm": pfm(VALUES),
             "a.hdr": radiance(VALUES)}  # fmt: skip
    for name, data in files.items():
        picture = images.decode("a", data, srgb=True)
        assert not picture.srgb
        np.testing.assert_allclose(picture.linear, VALUES, atol=4 / 128, err_msg=name)


def test_a_tiff_of_numbers_is_linear(tmp_path: Path) -> None:
    Image.fromarray(VALUES[..., 0] / 4).save(tmp_path / "a.tiff")
    picture = images.load(tmp_path / "a.tiff", srgb=True)
    np.testing.assert_allclose(picture.linear[..., 0], VALUES[..., 0] / 4)


def test_dark_sixteen_bits_stay_dark(tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 2), 200, np.uint16)).save(tmp_path / "a.png")
    assert images.load(tmp_path / "a.png", srgb=False).linear.max() < 0.01


def test_a_lamp_with_such_pictures(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", VALUES)
    write_exr(tmp_path / "b.exr", VALUES / 4)
    material, light, notes = lamp(tmp_path, "b.exr", "a.exr")
    assert isinstance(material.base_color, Picture)
    np.testing.assert_allclose(material.base_color.linear, VALUES / 4, atol=1e-3)
    np.testing.assert_allclose(light.linear, VALUES, atol=1e-3)
    assert not any("above one" in line for line in notes)


def test_what_no_surface_reflects_is_noted(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", VALUES)
    _, _, notes = lamp(tmp_path, "a.exr", "a.exr")
    (said,) = [line for line in notes if "above one" in line]
    assert "Shade" in said
    assert "Glow" not in said


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"BLENDER-v300", "give it as PNG"),
        (pfm(np.full((1, 1, 3), np.nan)), "no numbers"),
        (b"PF\n100000 100000\n-1.0\n", "100000 x 100000"),
        (b"PF\n0 1\n-1.0\n", "0 x 1"),
        (b"PF\n4 4\n-1.0\n1234", "cannot be decoded"),
        (b"#?RADIANCE\n\n-Y 99999 +X 99999\n", "99999 x 99999"),
        (b"#?RADIANCE\n", "its size"),
        (b"\x76\x2f\x31\x01\2\0\0\0", "its size"),
    ],
)
def test_what_is_none_is_a_line(data: bytes, reason: str) -> None:
    with pytest.raises(PureLightError, match=reason) as told:
        images.decode("a", data, srgb=False)
    assert "\n" not in str(told.value)


def test_a_size_beyond_reason_is_not_allocated(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", VALUES)
    data = (tmp_path / "a.exr").read_bytes()
    window = np.array([0, 0, 2, 1], "<i4").tobytes()
    large = data.replace(window, np.array([-2000000, 0, 2000000, 99999], "<i4").tobytes())
    with pytest.raises(PureLightError, match="4000001 x 100000 pixels are too many"):
        images.decode("a", large, srgb=False)


def test_large_ones_are_reduced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LARGEST_PICTURE", 4)
    wide = np.broadcast_to(np.float32([1, 2, 3]), (2, 16, 3))
    picture = images.decode("a", pfm(wide), srgb=False)
    assert picture.pixels.shape == (1, 4, 3)
    np.testing.assert_allclose(picture.linear, np.broadcast_to([1, 2, 3], (1, 4, 3)))
