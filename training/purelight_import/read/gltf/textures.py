"""Textures of glTF materials."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.picture import Picture
from purelight_import.read import images
from purelight_import.read.gltf.document import Document, Object

WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
NEAREST = 9728
WEBP, BASIS, TRANSFORM = "EXT_texture_webp", "KHR_texture_basisu", "KHR_texture_transform"


@dataclass
class Textures:
    """Decodes each picture once.

    Attributes:
        uv_set: the texture coordinates that the material read last asks for, None for any.
    """

    document: Document
    decoded: dict[tuple[int, bool], Picture | None] = field(default_factory=dict)
    uv_set: int | None = None

    def picture(self, about: Object | None, where: str, *, srgb: bool = False) -> Picture | None:
        """The picture of a texture reference; None where there is none that can be taken.

        Arguments:
            where: name of the material, for notes.
        """
        if not about:
            return None
        texture = self.document.item("textures", about.get("index"))
        source = self._source(texture, where)
        if source is None:
            return None
        if (source, srgb) not in self.decoded:
            self.decoded[source, srgb] = self._decode(source, srgb, where)
        picture = self.decoded[source, srgb]
        return None if picture is None else self._placed(picture, texture, about, where)

    def _source(self, texture: Object, where: str) -> int | None:
        """Which image a texture shows."""
        extensions = texture.get("extensions", {})
        if "source" in texture:
            return int(texture["source"])
        if WEBP in extensions:
            return int(extensions[WEBP]["source"])
        kind = "KTX2 (Basis)" if BASIS in extensions else "unknown"
        self.document.notes(f"textures of the kind {kind} are left out", where)
        return None

    def _decode(self, source: int, srgb: bool, where: str) -> Picture | None:
        about = self.document.item("images", source)
        name = str(about.get("name") or about.get("uri", "")[:40] or f"image_{source}")
        if name.startswith("data:"):
            name = f"image_{source}"
        try:
            if "bufferView" in about:
                data = self.document.view(about["bufferView"])
            else:
                data = self.document.load(str(about["uri"]), limits.PICTURE_BYTES)
            return images.decode(name, data, srgb=srgb)
        except PureLightError as error:
            self.document.notes(f"a texture is left out: {error}", where)
            return None

    def _placed(self, picture: Picture, texture: Object, about: Object, where: str) -> Picture:
        """The picture with the sampler, transform and coordinates of its reference."""
        sampler = {}
        if "sampler" in texture:
            sampler = self.document.item("samplers", texture["sampler"])
        wraps = [WRAPS.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT")]
        transform = about.get("extensions", {}).get(TRANSFORM, {})
        uv_set = int(transform.get("texCoord", about.get("texCoord", 0)))
        if self.uv_set is None:
            self.uv_set = uv_set
        elif uv_set != self.uv_set:
            self.document.notes("of several texture coordinates the first are taken", where)
        return replace(
            picture, wrap=wraps[0], smooth=sampler.get("magFilter") != NEAREST,
            to_uv=_matrix(transform) if transform else None,
        )  # fmt: skip


def _matrix(transform: Object) -> Any:
    """Texture transform [3, 3]: translation, rotation and scale (KHR_texture_transform)."""
    (x, y), (sx, sy) = transform.get("offset", (0, 0)), transform.get("scale", (1, 1))
    angle = float(transform.get("rotation", 0))
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return np.array([[1, 0, x], [0, 1, y], [0, 0, 1.0]]) @ turn @ np.diag([sx, sy, 1.0])
