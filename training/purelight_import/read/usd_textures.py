"""Textures of USD stages."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.notes import Notes
from purelight_import.model.picture import Picture
from purelight_import.read import images
from purelight_import.read.beside import beside
from purelight_mitsuba.usd_scene.shader_inputs import connected, uv_transform, value, wrap_mode
from purelight_mitsuba.usd_scene.values import Values


@dataclass
class Textures:
    """Decodes each picture once.

    Arguments:
        path: of the stage.
    """

    values: Values
    notes: Notes
    path: Path
    decoded: dict[tuple[str, bool], Picture | None] = field(default_factory=dict)

    def picture(self, reader: Any, material: str, *, srgb: bool) -> Picture | None:
        """What a `UsdUVTexture` shows; None where it cannot be read, which is noted.

        Arguments:
            srgb: whether it is encoded if it does not say so itself.
        """
        space = str(value(reader, "sourceColorSpace", "auto", self.values))
        encoded = srgb if space == "auto" else space == "sRGB"
        asset = value(reader, "file", None, self.values)
        name = "" if asset is None else str(asset.path)
        if (name, encoded) not in self.decoded:
            self.decoded[name, encoded] = self._load(asset, name, material, srgb=encoded)
        picture = self.decoded[name, encoded]
        if picture is None:
            return None
        picture = replace(picture, wrap=wrap_mode(reader, self.values))
        return self._scaled(picture, reader).under(self._transform(reader, material))

    def _scaled(self, picture: Picture, reader: Any) -> Picture:
        scale = np.asarray(value(reader, "scale", (1, 1, 1, 1), self.values), np.float32)
        bias = np.asarray(value(reader, "bias", (0, 0, 0, 0), self.values), np.float32)
        count = picture.pixels.shape[2]
        normal = "normal" in str(reader.GetPath()).lower() and scale[0] == 2
        if normal or not ((scale != 1).any() or (bias != 0).any()):
            return picture
        pixels = np.maximum(picture.linear * scale[:count] + bias[:count], 0)
        return replace(picture, pixels=pixels, srgb=False)

    def _transform(self, reader: Any, material: str) -> NDArray[np.float64]:
        """What `uv_transform` says, if that is numbers: [3, 3]."""
        source = connected(reader, "st")
        before = connected(source[0], "in") if source is not None else None
        if before is not None and before[0].GetIdAttr().Get() == "UsdTransform2d":
            self.notes("of several transforms of a texture the last is taken", material)
        matrix = uv_transform(reader, self.values)
        return matrix if np.isfinite(matrix).all() else np.eye(3)

    def _load(self, asset: Any, name: str, material: str, *, srgb: bool) -> Picture | None:
        """A texture beside the stage, or within a package."""
        from pxr import Ar

        try:
            resolved = str(asset.resolvedPath) if asset is not None else ""
            folder = self.path.resolve().parent
            if Ar.IsPackageRelativePath(resolved):
                package = Path(Ar.SplitPackageRelativePathOuter(resolved)[0]).resolve()
                opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
                within = package.is_relative_to(folder)
                if not within or not opened or opened.GetSize() > limits.PICTURE_BYTES:
                    raise PureLightError(f"{name} cannot be read")
                return images.decode(Path(name).stem, bytes(opened.GetBuffer()), srgb=srgb)
            relative = Path(resolved or name)
            if relative.is_absolute() and relative.is_relative_to(folder):
                relative = relative.relative_to(folder)
            return images.load(beside(folder, str(relative)), srgb=srgb)
        except PureLightError as error:
            self.notes(f"a texture is left out: {error}", material)
            return None
