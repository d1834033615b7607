"""Pictures as files beside the scene, and as textures that name them."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model.names import Names, tidy
from purelight_import.model.picture import Picture
from purelight_import.write import xml
from purelight_onnx.picture import write_exr

FOLDER = "textures"


@dataclass
class Textures:
    """Writes each picture once, with a name of its own.

    Arguments:
        folder: of the scene.
    """

    folder: Path
    written: dict[int, tuple[str, Picture]] = field(default_factory=dict)
    names: Names = field(default_factory=Names)

    def element(self, picture: Picture, name: str, *, radiance: bool = False) -> ET.Element:
        """A texture of a parameter; radiance keeps values above one."""
        texture = ET.Element("texture", type="bitmap", name=name)
        filename, raw = self._file(picture, radiance=radiance)
        xml.text(texture, "filename", filename)
        if raw:
            xml.flag(texture, "raw", value=True)
        if picture.wrap != "repeat":
            xml.text(texture, "wrap_mode", picture.wrap)
        if not picture.smooth:
            xml.text(texture, "filter_type", "nearest")
        if picture.to_uv is not None:
            whole = np.eye(4)
            whole[:2, :2], whole[:2, 3] = picture.to_uv[:2, :2], picture.to_uv[:2, 2]
            xml.matrix(texture, "to_uv", whole)
        return texture

    def copy(self, path: str, name: str) -> str:
        """Copies a file that a material names; returns what to call it."""
        suffix = tidy(Path(name).suffix.lower())
        filename = self._name(Path(name).stem, f".{suffix}" if suffix else "")
        try:
            shutil.copyfile(path, self.folder / filename)
        except OSError as error:
            raise PureLightError(f"{path}: cannot be copied: {error.strerror}") from error
        return filename

    def _file(self, picture: Picture, *, radiance: bool) -> tuple[str, bool]:
        """The name of a picture's file, and whether its values are linear numbers."""
        bright = radiance and picture.pixels.dtype != np.uint8
        data, encoded = picture.bytes()
        key = hash(
            (bright, encoded, picture.pixels.shape, (picture.pixels if bright else data).tobytes())
        )
        if key not in self.written:
            filename = self._name(picture.name, ".exr" if bright else ".png")
            self._write(self.folder / filename, picture.linear if bright else data)
            self.written[key] = filename, picture
        return self.written[key][0], bright or not encoded

    @staticmethod
    def _write(path: Path, pixels: np.ndarray) -> None:
        if path.suffix == ".exr":
            write_exr(path, pixels)
            return
        from PIL import Image

        Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels).save(path, "PNG")

    def _name(self, wanted: str, suffix: str) -> str:
        (self.folder / FOLDER).mkdir(exist_ok=True)
        return f"{FOLDER}/{self.names.fresh(tidy(wanted) or 'texture')}{suffix}"
