"""glTF materials in plain words."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from purelight_format.color import LUMENS_PER_WATT
from purelight_import.model.material import BLACK, RGB, WHITE, Color, Material, Value, absorption
from purelight_import.model.picture import Picture
from purelight_import.read.gltf.document import Document, Object
from purelight_import.read.gltf.textures import Textures

KHR = "KHR_materials_"
TAKEN = {KHR + name for name in (
    "transmission", "volume", "ior", "emissive_strength", "clearcoat", "specular", "sheen",
    "anisotropy", "diffuse_transmission", "pbrSpecularGlossiness", "unlit",
)}  # fmt: skip
UNTAKEN = {
    KHR + "dispersion": "dispersion is left out: light has three channels, each of the same index",
    KHR + "iridescence": "iridescence is left out",
    KHR + "volume_scatter": "scattering within glass is left out",
    KHR + "variants": "of a material's variants the first is taken",
}
OPAQUE_LIMIT = 1e-3
BLENDED = (
    "alpha is taken as holes too small to see, which bend no ray "
    "(--glass NAME=solid or thin makes glass of it)"
)


@dataclass(frozen=True)
class Surface:
    """A material with what glTF counts to it.

    Arguments:
        radiance: W/(m² sr), None if it does not emit.
        uv_set: the texture coordinates it asks for.
    """

    material: Material
    radiance: Color | None = None
    double_sided: bool = False
    uv_set: int = 0


@dataclass
class Materials:
    """Makes each material once."""

    document: Document
    made: dict[int, Surface] = field(default_factory=dict)

    def surface(self, index: Any) -> Surface:
        """The material of a primitive; glTF's default one if it names none."""
        if index is None:
            return Surface(Material("", WHITE, 0.0, 1.0))
        if index not in self.made:
            self.made[index] = _Reading(self.document, index).surface()
        return self.made[index]


class _Reading:
    """Reads one material."""

    def __init__(self, document: Document, index: Any) -> None:
        self.about = document.item("materials", index)
        self.name = str(self.about.get("name") or f"material_{index}")
        self.notes, self.textures = document.notes, Textures(document)
        self.extensions: Object = self.about.get("extensions", {})

    def surface(self) -> Surface:
        for name in self.extensions:
            if name not in TAKEN:
                self.notes(UNTAKEN.get(name, f"{name} is left out"), self.name)
        material = self._specular_glossiness() or self._metallic_roughness()
        material = self._alpha(self._coats(self._glass(material)))
        radiance, normal = self._radiance(), self._normal()
        if KHR + "unlit" in self.extensions:
            self.notes("unlit materials are taken as matt ones", self.name)
        return Surface(
            replace(material, normal=normal), radiance, bool(self.about.get("doubleSided")),
            self.textures.uv_set or 0,
        )  # fmt: skip

    def _extension(self, name: str) -> Object | None:
        found = self.extensions.get(KHR + name)
        return found if isinstance(found, dict) else None

    def _metallic_roughness(self) -> Material:
        about: Object = self.about.get("pbrMetallicRoughness", {})
        base = self.textures.picture(about.get("baseColorTexture"), self.name, srgb=True)
        rough = self.textures.picture(about.get("metallicRoughnessTexture"), self.name)
        self.alpha = (base, float(about.get("baseColorFactor", (1, 1, 1, 1))[3]))
        return Material(
            self.name,
            _colored(base, _rgb(about.get("baseColorFactor", (1, 1, 1, 1)))),
            _valued(rough, 2, float(about.get("metallicFactor", 1))),
            _valued(rough, 1, float(about.get("roughnessFactor", 1))),
        )

    def _specular_glossiness(self) -> Material | None:
        """The older workflow: metals are what reflects more than half and is not diffuse."""
        about = self._extension("pbrSpecularGlossiness")
        if about is None:
            return None
        self.notes("specular-glossiness materials are taken as metals or plastics", self.name)
        diffuse = self.textures.picture(about.get("diffuseTexture"), self.name, srgb=True)
        factor = about.get("diffuseFactor", (1, 1, 1, 1))
        self.alpha = (diffuse, float(factor[3]))
        specular = _rgb(about.get("specularFactor", WHITE))
        glossy = self.textures.picture(about.get("specularGlossinessTexture"), self.name, srgb=True)
        mean = specular if glossy is None else tuple(glossy.mean()[:3] * specular)
        roughness = 1 - float(about.get("glossinessFactor", 1))
        if glossy is not None:
            roughness = 1 - float(glossy.channels(3).mean()[0]) * (1 - roughness)
        if max(mean) > 0.5:
            return Material(self.name, _colored(glossy, specular), 1.0, roughness)
        return Material(self.name, _colored(diffuse, _rgb(factor)), 0.0, roughness)

    def _glass(self, material: Material) -> Material:
        ior = (self._extension("ior") or {}).get("ior", 1.5)
        transmission = self._extension("transmission") or {}
        picture = self.textures.picture(transmission.get("transmissionTexture"), self.name)
        through = self._extension("diffuse_transmission") or {}
        volume = self._extension("volume")
        thickness = 0.0 if volume is None else float(volume.get("thicknessFactor", 0))
        passes = _valued(picture, 0, float(transmission.get("transmissionFactor", 0)))
        if passes != 0.0 and material.metalness == 1.0:
            self.notes("metal lets no light through, though its material has transmission "
                       "(--glass NAME=solid or thin makes glass of it)", self.name)  # fmt: skip
        return replace(
            material,
            ior=max(float(ior), 1.0) if ior else 1.5,
            transmission=passes,
            diffuse_transmission=float(through.get("diffuseTransmissionFactor", 0)),
            thin_walled=not thickness > 0,
            attenuation=_attenuation(volume) if volume and thickness > 0 else None,
        )

    def _coats(self, material: Material) -> Material:
        coat, sheen = self._extension("clearcoat") or {}, self._extension("sheen") or {}
        specular = self._extension("specular") or {}
        if _rgb(specular.get("specularColorFactor", WHITE)) != WHITE:
            self.notes("the colour of reflections on what is no metal is left out", self.name)
        picture = self.textures.picture(coat.get("clearcoatTexture"), self.name)
        return replace(
            material,
            coat=_valued(picture, 0, float(coat.get("clearcoatFactor", 0))),
            coat_roughness=float(coat.get("clearcoatRoughnessFactor", 0)),
            sheen=max(_rgb(sheen.get("sheenColorFactor", BLACK))),
            specular=float(specular.get("specularFactor", 1)),
            anisotropy=float((self._extension("anisotropy") or {}).get("anisotropyStrength", 0)),
        )

    def _alpha(self, material: Material) -> Material:
        """Coverage, which only counts in the modes MASK and BLEND."""
        mode, (picture, factor) = self.about.get("alphaMode", "OPAQUE"), self.alpha
        if mode not in ("MASK", "BLEND"):
            return material
        cover: Value = factor
        if picture is not None and picture.pixels.shape[2] == 4:
            cover = picture.channels(3).times(factor)
        if mode == "MASK":
            cutoff = float(self.about.get("alphaCutoff", 0.5))
            cover = _cut(cover, cutoff)
        elif cover != 1.0 and not isinstance(cover, Picture):
            self.notes(BLENDED, material.name)
        return replace(material, opacity=cover)

    def _radiance(self) -> Color | None:
        """Emission; glTF's unit of it is cd/m²."""
        strength = float((self._extension("emissive_strength") or {}).get("emissiveStrength", 1))
        factor = np.array(_rgb(self.about.get("emissiveFactor", BLACK))) * strength
        if not factor.max() > 0:
            return None
        picture = self.textures.picture(self.about.get("emissiveTexture"), self.name, srgb=True)
        if picture is not None and not picture.colors().mean().max() > 0:
            return None
        return _colored(picture, _rgb(factor / LUMENS_PER_WATT))

    def _normal(self) -> Picture | None:
        about = self.about.get("normalTexture")
        picture = self.textures.picture(about, self.name)
        if picture is None:
            return None
        picture = picture.colors()
        scale = float(about.get("scale", 1)) if about else 1.0
        if scale == 1:
            return picture
        tilt = picture.linear * 2 - 1
        tilt[..., :2] *= scale
        tilt /= np.maximum(np.linalg.norm(tilt, axis=2, keepdims=True), 1e-6)
        return replace(picture, pixels=np.rint(127.5 * tilt + 127.5).astype(np.uint8))


def _attenuation(volume: Object) -> RGB | None:
    """Absorption coefficient (KHR_materials_volume)."""
    distance = float(volume.get("attenuationDistance", np.inf))
    return absorption(_rgb(volume.get("attenuationColor", WHITE)), distance)


def _cut(cover: Value, cutoff: float) -> Value:
    if not isinstance(cover, Picture):
        return float(cover >= cutoff)
    return replace(cover, pixels=np.uint8(255) * (cover.linear >= cutoff).astype(np.uint8))


def _rgb(value: Any) -> RGB:
    r, g, b = (float(v) for v in list(value)[:3])
    if not np.isfinite([r, g, b]).all():
        raise ValueError("a colour is no number")
    return max(r, 0.0), max(g, 0.0), max(b, 0.0)


def _colored(picture: Picture | None, factor: RGB) -> Color:
    return factor if picture is None else picture.colors().times(factor)


def _valued(picture: Picture | None, channel: int, factor: float) -> Value:
    """A number, or one channel of a picture times it."""
    if picture is None or factor == 0:
        return factor
    one = picture.channels(channel)
    low, high = one.pixels.min(), one.pixels.max()
    if low == high:  # One value everywhere needs no picture.
        return float(one.mean()[0]) * factor
    return one.times(factor)
