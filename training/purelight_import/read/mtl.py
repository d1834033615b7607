"""Material libraries of Wavefront OBJ, with the PBR extension."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.material import BLACK, RGB, WHITE, Color, Material
from purelight_import.model.notes import Notes
from purelight_import.model.picture import Picture
from purelight_import.read import images
from purelight_import.read.beside import gathered

Library = dict[str, tuple[Material, Color | None]]
Words = dict[str, list[str]]
REFRACTING, MAYBE_GLASS, DULL = ("6", "7"), ("4", "9"), ("0", "1")
# Options of texture statements, and how many words follow each
OPTIONS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1,
           "-cc": 1, "-clamp": 1, "-imfchan": 1, "-texres": 1, "-type": 1,
           "-colorspace": 1}  # fmt: skip
BLENDER_SHARPEST = 1000.0  # Ns of roughness zero


def read_mtl(path: Path, notes: Notes, *, blender: bool = False) -> Library:
    """Materials and emission (W/(m² sr), None without) by name.

    Arguments:
        blender: whether Blender wrote it, which has a formula of its own for Ns.

    Raises:
        PureLightError: it cannot be read.
    """
    text = files.read_file(path, limits.TEXT_BYTES).decode("utf-8-sig", errors="replace")
    read: dict[str, Words] = {}
    words: Words = {}
    for line in text.splitlines():
        key, *rest = line.strip().split(None, 1) or [""]
        if key.lower() == "newmtl":
            words = read.setdefault(" ".join(rest).strip(), {})
        elif rest and not key.startswith("#"):
            words[key.lower()] = rest[0].split()
    return {
        name: (_Reading(name, about, path, notes, blender=blender).material(),
               _Reading(name, about, path, notes, blender=blender).radiance())
        for name, about in read.items()
    }  # fmt: skip


class _Reading:
    """Reads one material."""

    def __init__(self, name: str, words: Words, path: Path, notes: Notes, *, blender: bool) -> None:
        self.name, self.words, self.folder, self.notes = name, words, path.parent, notes
        self.blender = blender

    def material(self) -> Material:
        diffuse, shine = self._color("kd", (0.8, 0.8, 0.8)), self._color("ks", BLACK)
        metal = self._number("pm", 0.0)
        mirror = self._kind() == "3" and max(diffuse) < 0.05 and max(shine) > 0.3
        if "pm" not in self.words and mirror:
            metal, diffuse = 1.0, shine
        picture = self._picture("map_kd", srgb=True)
        base: Color = diffuse
        if picture is not None:
            base = picture.colors().times(WHITE if max(diffuse) == 0 else diffuse)
        dull = "pr" not in self.words and (max(shine) == 0 or self._kind() in DULL)
        material = Material(
            self.name, base, self._mapped("map_pm", metal), self._roughness(),
            ior=max(self._number("ni", 1.5), 1.0), specular=0.0 if dull and metal == 0 else 1.0,
            coat=self._number("pc", 0.0), coat_roughness=self._number("pcr", 0.0),
            sheen=self._number("ps", 0.0), anisotropy=self._number("aniso", 0.0),
        )  # fmt: skip
        return self._cover(self._glass(material, diffuse))

    def radiance(self) -> Color | None:
        """Emission; the format has no unit for it, Blender's is W/(m² sr)."""
        color, picture = self._color("ke", BLACK), self._picture("map_ke", srgb=True)
        if picture is not None:
            return picture.colors().times(WHITE if max(color) == 0 else color)
        return color if max(color) > 0 else None

    def _kind(self) -> str:
        return (self.words.get("illum") or ["2"])[0]

    def _glass(self, material: Material, diffuse: RGB) -> Material:
        """Glass is what says so (illum 6, 7), or lets light pass (d, Tr, Tf)."""
        opacity = self._opacity()
        filtered = "tf" in self.words and max(self._color("tf", BLACK)) > 0
        kind = self._kind()
        if not (kind in REFRACTING or opacity < 1 or (kind in MAYBE_GLASS and filtered)):
            return material
        tint = self._color("tf", WHITE) if filtered else diffuse
        brightest = max(tint)
        color: RGB = WHITE
        if brightest >= 0.2:
            color = (tint[0] / brightest, tint[1] / brightest, tint[2] / brightest)
        through = 1.0 if kind in REFRACTING or opacity <= 0.5 or opacity == 1 else 1 - opacity
        if not isinstance(material.base_color, Picture):
            material = replace(material, base_color=color)
        smooth = "ns" not in self.words and "pr" not in self.words
        return replace(
            material, transmission=through, ior=material.ior if material.ior > 1.01 else 1.5,
            roughness=0.0 if smooth else material.roughness, metalness=0.0, specular=1.0,
        )  # fmt: skip

    def _opacity(self) -> float:
        words = self.words.get("d", [])
        if words and words[0] != "-halo":
            return float(np.clip(float(words[0]), 0, 1))
        return 1 - min(max(self._number("tr", 0.0), 0.0), 1.0)

    def _cover(self, material: Material) -> Material:
        picture = self._picture("map_d")
        if picture is None:
            return material
        alpha = picture.pixels.shape[2] in (2, 4)
        return replace(material, opacity=picture.channels(3 if alpha else 0))

    def _roughness(self) -> float | Picture:
        """Roughness as such, or from the exponent of highlights (Walter et al. 2007)."""
        if "pr" in self.words or "map_pr" in self.words:
            return self._mapped(
                "map_pr", self._number("pr", 1.0 if "map_pr" in self.words else 0.5)
            )
        if "ns" not in self.words:
            return 0.5
        exponent = max(self._number("ns", 10.0), 0.0)
        if self.blender:
            return 1 - float(np.sqrt(min(exponent / BLENDER_SHARPEST, 1)))
        return 0.0 if exponent >= 900 else float((2 / (exponent + 2)) ** 0.25)

    def _mapped(self, key: str, factor: float) -> float | Picture:
        picture = self._picture(key)
        return factor if picture is None else picture.channels(0).times(factor)

    def _number(self, key: str, default: float) -> float:
        words = self.words.get(key)
        value = float(words[0]) if words else default
        if not np.isfinite(value):
            raise ValueError(f"{key} of {self.name} is no number")
        return value

    def _color(self, key: str, default: RGB) -> RGB:
        words = self.words.get(key)
        if not words:
            return default
        if words[0] in ("spectral", "xyz"):
            self.notes(f"{key} as {words[0]} is left out", self.name)
            return default
        r, g, b = ([*map(float, words[:3])] * 3)[:3] if len(words) < 3 else map(float, words[:3])
        if not np.isfinite([r, g, b]).all():
            raise ValueError(f"{key} of {self.name} is no number")
        return max(r, 0.0), max(g, 0.0), max(b, 0.0)

    def _picture(self, key: str, *, srgb: bool = False) -> Picture | None:
        name, options = _split(self.words.get(key, []))
        if not name:
            return None
        try:
            picture = images.load(gathered(self.folder, name, self.notes), srgb=srgb)
        except PureLightError as error:
            self.notes(f"a texture is left out: {error}", self.name)
            return None
        if options.get("-clamp") == ["on"]:
            picture = replace(picture, wrap="clamp")
        return picture.under(_transform(options))


def _split(words: list[str]) -> tuple[str, dict[str, list[str]]]:
    """The name of a texture's file, and the options before it."""
    words, options = list(words), dict[str, list[str]]()
    while words and words[0] in OPTIONS:
        option = words.pop(0)
        values = options[option] = []
        while len(values) < OPTIONS[option] and len(words) > 1 and _numeric(words[0], option):
            values.append(words.pop(0))
    return " ".join(words), options


def _transform(options: dict[str, list[str]]) -> NDArray[np.float64]:
    """Texture coordinates [3, 3] are multiplied by -s, then -o is added."""
    matrix = np.eye(3)
    for row in range(2):
        for option, column in (("-s", row), ("-o", 2)):
            values = options.get(option, [])[row : row + 1]
            if values and np.isfinite(float(values[0])):
                matrix[row, column] = float(values[0])
    return matrix


def _numeric(word: str, option: str) -> bool:
    """Whether a word belongs to an option, not to the file's name."""
    if OPTIONS[option] == 1:
        return True
    try:
        float(word)
    except ValueError:
        return False
    return True
