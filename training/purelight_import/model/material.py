"""Materials in plain words, those of OpenPBR where it has one."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, fields, replace

from purelight_import.model.frame import Frame
from purelight_import.model.picture import Picture

RGB = tuple[float, float, float]
Value = float | Picture
Color = RGB | Picture
WHITE: RGB = (1.0, 1.0, 1.0)
BLACK: RGB = (0.0, 0.0, 0.0)


def absorption(color: Color, distance: float) -> RGB | None:
    """Absorption coefficient by which white light has a colour after a distance: -ln(c) / d.

    None where nothing is absorbed, or the colour is a picture's.
    """
    if isinstance(color, Picture) or not 0 < distance < math.inf or min(color) >= 1:
        return None
    r, g, b = (-math.log(min(max(value, 1e-4), 1)) / distance for value in color)
    return r, g, b


@dataclass(frozen=True)
class Material:
    """A surface, and what is behind it.

    Arguments:
        name: of the file's material, "" without one.
        base_color: reflectance of what is diffuse, of metals at right angles; of glass, what
            passes each surface.
        metalness, roughness: in [0, 1]; the microfacets' alpha is the roughness squared.
        ior: index of refraction.
        specular: factor on the reflectance at right angles.
        transmission: share of the base that is glass.
        thin_walled: whether glass is a sheet, which bends no ray, and not a body's surface.
        attenuation: absorption coefficient of the body behind the surface, per unit of the lamp's
            lengths; None is none.
        diffuse_transmission: share of diffuse light that passes, as through paper.
        coat, coat_roughness: clear layer on top.
        sheen: of cloth.
        anisotropy: of reflections.
        opacity: 0 where the surface is not there.
        normal: tangent-space normals, as bytes about 127.5.
    """

    name: str = ""
    base_color: Color = (0.8, 0.8, 0.8)
    metalness: Value = 0.0
    roughness: Value = 0.5
    ior: float = 1.5
    specular: float = 1.0
    transmission: Value = 0.0
    thin_walled: bool = False
    attenuation: RGB | None = None
    diffuse_transmission: float = 0.0
    coat: Value = 0.0
    coat_roughness: float = 0.0
    sheen: float = 0.0
    anisotropy: float = 0.0
    opacity: Value = 1.0
    normal: Picture | None = None

    @property
    def glass(self) -> bool:
        """Whether light passes it by refraction; what is metal all over lets none through."""
        passes = isinstance(self.transmission, Picture) or self.transmission > 0
        return passes and (isinstance(self.metalness, Picture) or self.metalness < 1)

    @property
    def pictures(self) -> dict[str, Picture]:
        """The arguments that are pictures, by name."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, Picture)}

    def moved(self, frame: Frame) -> Material:
        """The same in metres."""
        if self.attenuation is None or frame.metres == 1:
            return self
        r, g, b = (value / frame.metres for value in self.attenuation)
        return replace(self, attenuation=(r, g, b))

    @property
    def cut(self) -> bool:
        """Whether a picture has values above one, which no surface reflects: they are cut."""
        return any(picture.above_one for picture in self.pictures.values())


@dataclass(frozen=True)
class Verbatim:
    """A material that Mitsuba wrote itself.

    Arguments:
        name: of the BSDF.
        elements: XML of the shape's BSDF and media, without references.
        files: what names of files in them stand for, name and path.
        glass: whether it refracts.
    """

    name: str
    elements: tuple[str, ...]
    files: tuple[tuple[str, str], ...] = ()
    glass: bool = False

    def moved(self, frame: Frame) -> Verbatim:
        """The same in metres with +Z up: media are as dense, and their grids where they were."""
        if (frame.metres, frame.up) == (1, "z"):
            return self
        elements = [ET.fromstring(text) for text in self.elements]
        for medium in (e for e in elements if e.tag == "medium"):
            _rescaled(medium, 1 / frame.metres)
            for volume in (e for e in medium.iter("volume") if e.get("type") != "constvolume"):
                _placed(volume, frame)
        texts = tuple(ET.tostring(element, encoding="unicode") for element in elements)
        return replace(self, elements=texts)


def _rescaled(medium: ET.Element, factor: float) -> None:
    """Multiplies a medium's density."""
    stated = [e for e in medium if e.get("name") == "scale"]
    scale = stated[0] if stated else ET.SubElement(medium, "float", name="scale", value="1")
    scale.set("value", repr(float(scale.get("value", "1")) * factor))


def _placed(volume: ET.Element, frame: Frame) -> None:
    """Moves a grid after its own transform."""
    found = [e for e in volume if e.get("name") == "to_world"]
    transform = found[0] if found else ET.SubElement(volume, "transform", name="to_world")
    values = " ".join(repr(float(value)) for value in frame.matrix.ravel())
    ET.SubElement(transform, "matrix", value=values)
