"""A material in plain words as Mitsuba's BSDF and the medium behind it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np

from purelight_import.model.material import WHITE, Color, Material, Value
from purelight_import.model.picture import Picture, mean_of
from purelight_import.write import xml
from purelight_import.write.textures import Textures

SMOOTH = 0.03  # roughness below which a surface is a mirror
LEAST_ROUGHNESS = 0.02  # of the principled BSDF, below which samples get too bright
WHOLE, GREY = 0.999, 0.5  # shares, from which on something counts as all, as a metal


def elements(material: Material, textures: Textures, *, solid: bool) -> list[ET.Element]:
    """The BSDF, and for coloured bodies of glass their medium.

    Arguments:
        solid: of glass, whether it is a body or a sheet.
    """
    bsdf = _bsdf(material, textures, solid)
    if material.normal is not None:
        bsdf = _wrapped("normalmap", bsdf)
        bsdf.insert(0, textures.element(material.normal, "normalmap"))
    if not material.glass and bsdf.get("type") != "principledthin":
        bsdf = _wrapped("twosided", bsdf)
    if material.opacity != 1.0:
        bsdf = _wrapped("mask", bsdf)
        _value(bsdf, "opacity", material.opacity, textures)
    found = [bsdf]
    if solid and material.attenuation is not None:
        found.append(_medium(material.attenuation))
    return found


def _bsdf(material: Material, textures: Textures, solid: bool) -> ET.Element:
    """The BSDF that fits a material best."""
    if material.glass:
        if _whole(material.transmission) and mean_of(material.metalness) < GREY:
            return _glass(material, textures, solid)
        return _principled(material, textures, solid=solid)
    if material.diffuse_transmission > 0:
        return _principled(material, textures, solid=False)
    if _whole(material.metalness) and material.coat == 0:
        return _metal(material, textures)
    if material.specular == 0 and material.metalness == 0 and material.coat == 0:
        bsdf = ET.Element("bsdf", type="diffuse")
        _color(bsdf, "reflectance", material.base_color, textures)
        return bsdf
    return _principled(material, textures, solid=True)


def _glass(material: Material, textures: Textures, solid: bool) -> ET.Element:
    """Glass alone: by formula where it is smooth, or a body."""
    rough = not isinstance(material.roughness, Picture) and material.roughness > SMOOTH
    if not solid and (rough or isinstance(material.roughness, Picture)):
        return _principled(material, textures, solid=False)
    mapped = rough or isinstance(material.roughness, Picture)
    kind = "roughdielectric" if mapped else "dielectric" if solid else "thindielectric"
    bsdf = ET.Element("bsdf", type=kind)
    xml.number(bsdf, "int_ior", max(material.ior, 1.0001))
    xml.number(bsdf, "ext_ior", 1.0)
    if mapped:
        xml.text(bsdf, "distribution", "ggx")
        _value(bsdf, "alpha", _alpha(material.roughness), textures)
    if material.base_color != WHITE:
        _color(bsdf, "specular_transmittance", _at_most_one(material.base_color), textures)
    return bsdf


def _metal(material: Material, textures: Textures) -> ET.Element:
    mirror = not isinstance(material.roughness, Picture) and material.roughness < SMOOTH
    bsdf = ET.Element("bsdf", type="conductor" if mirror else "roughconductor")
    xml.text(bsdf, "material", "none")
    if not mirror:
        xml.text(bsdf, "distribution", "ggx")
        _value(bsdf, "alpha", _alpha(material.roughness), textures)
    _color(bsdf, "specular_reflectance", _at_most_one(material.base_color), textures)
    return bsdf


def _principled(material: Material, textures: Textures, *, solid: bool) -> ET.Element:
    """Disney's BSDF, of a body or of a sheet."""
    thin = not solid and (material.glass or material.diffuse_transmission > 0)
    bsdf = ET.Element("bsdf", type="principledthin" if thin else "principled")
    _color(bsdf, "base_color", _at_most_one(material.base_color), textures)
    roughness = material.roughness
    if not isinstance(roughness, Picture):
        roughness = max(roughness, LEAST_ROUGHNESS)
    _value(bsdf, "roughness", roughness, textures)
    if material.anisotropy:
        xml.number(bsdf, "anisotropic", min(abs(material.anisotropy), 1.0))
    if material.sheen:
        xml.number(bsdf, "sheen", min(material.sheen, 1.0))
    xml.number(bsdf, "eta", index(material))
    if material.glass:
        _value(bsdf, "spec_trans", material.transmission, textures)
    if thin:
        if material.diffuse_transmission:
            xml.number(bsdf, "diff_trans", 2 * min(material.diffuse_transmission, 1.0))
        return bsdf
    if material.metalness != 0:
        _value(bsdf, "metallic", material.metalness, textures)
    if material.coat != 0:
        _value(bsdf, "clearcoat", material.coat, textures)
        xml.number(bsdf, "clearcoat_gloss", 1 - min(material.coat_roughness, 1.0))
    return bsdf


def index(material: Material) -> float:
    """The index whose reflectance at right angles is the material's, factor included."""
    if material.glass:
        return max(material.ior, 1.001)
    reflectance = material.specular * ((material.ior - 1) / (material.ior + 1)) ** 2
    root = np.sqrt(np.clip(reflectance, 1e-6, 0.9))
    return float((1 + root) / (1 - root))


def _medium(absorption: tuple[float, float, float]) -> ET.Element:
    """A medium that absorbs; coefficients above one need a scale."""
    medium = ET.Element("medium", type="homogeneous", name="interior")
    largest = max(absorption)
    xml.number(medium, "scale", largest)
    xml.color(medium, "sigma_t", (a / largest for a in absorption))
    xml.color(medium, "albedo", (0.0, 0.0, 0.0))
    return medium


def _wrapped(kind: str, bsdf: ET.Element) -> ET.Element:
    outer = ET.Element("bsdf", type=kind)
    outer.append(bsdf)
    return outer


def _whole(value: Value) -> bool:
    return not isinstance(value, Picture) and value >= WHOLE


def _alpha(roughness: Value) -> Value:
    """Width of the microfacets' distribution."""
    if isinstance(roughness, Picture):
        return replace(roughness, pixels=np.maximum(roughness.linear**2, 1e-3), srgb=False)
    return max(roughness, SMOOTH) ** 2


def _at_most_one(value: Color) -> Color:
    if isinstance(value, Picture):
        return value
    return min(value[0], 1.0), min(value[1], 1.0), min(value[2], 1.0)


def _color(bsdf: ET.Element, name: str, value: Color, textures: Textures) -> None:
    if isinstance(value, Picture):
        bsdf.append(textures.element(value, name))
    else:
        xml.color(bsdf, name, value)


def _value(bsdf: ET.Element, name: str, value: Value, textures: Textures) -> None:
    if isinstance(value, Picture):
        bsdf.append(textures.element(value, name))
    else:
        xml.number(bsdf, name, min(max(value, 0.0), 1.0))


def words(material: Material, *, solid: bool) -> str:
    """A material in a few words, for the list of parts."""
    rough = float(mean_of(material.roughness))
    if material.glass and float(mean_of(material.transmission)) > 0.02:
        kind = "glass body" if solid else "thin glass"
        tint = "" if material.attenuation is None else " that absorbs"
        return f"{'rough' if rough > SMOOTH else 'clear'} {kind}, n {material.ior:.3g}{tint}"
    if material.diffuse_transmission > 0:
        return "translucent"
    if float(mean_of(material.metalness)) > 0.5:
        return f"metal, roughness {rough:.2g}"
    if material.specular == 0:
        return "matt"
    return f"plastic, roughness {rough:.2g}"
