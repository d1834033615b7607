"""Glass, metal, plastic and cloth, drawn at random within what is physical."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace

from benchmarks.zoo.lamps import textures
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.pieces import Finish, Medium
from benchmarks.zoo.lamps.plugin import RGB, bsdf

METALS = ("Ag", "Al", "Au", "Cu", "Cr")
HUES: tuple[RGB, ...] = (
    (0.95, 0.55, 0.15), (0.9, 0.15, 0.1), (0.2, 0.75, 0.3), (0.15, 0.4, 0.9), (0.7, 0.25, 0.75),
    (0.3, 0.85, 0.85), (0.95, 0.85, 0.4),
)  # fmt: skip


@dataclass(frozen=True)
class Glass:
    """The finish of a glass body outside and in its hollow; one object where they are the same."""

    outside: Finish
    inside: Finish

    @property
    def diffuses(self) -> bool:
        """Whether it scatters the light that it passes."""
        traits = self.outside.traits | self.inside.traits
        return bool({"rough", "scattering"} & traits)


def glass(draw: Draw, thickness: float) -> Glass:
    """Glass for walls of about that thickness."""
    kinds = {
        "clear": 0.3, "rough": 0.18, "frosted": 0.14, "tinted": 0.15, "absorbing": 0.05,
        "milky": 0.03, "principled": 0.08, "blend": 0.07,
    }  # fmt: skip
    kind = draw.pick(list(kinds), list(kinds.values()))
    ior = draw.number(1.35, 1.9)
    clear = _finish(_clear(ior), "clear")
    if kind == "frosted":
        return Glass(_finish(_rough(draw, ior), "rough"), clear)
    made = {
        "clear": lambda: clear,
        "rough": lambda: _finish(_rough(draw, ior), "rough"),
        "tinted": lambda: _finish(
            bsdf("dielectric", int_ior=ior, ext_ior=1.0, specular_transmittance=tint(draw)),
            "clear", "coloured",
        ),
        "absorbing": lambda: replace(
            clear, medium=absorbing(draw, thickness), traits=clear.traits | {"medium", "coloured"}
        ),
        "milky": lambda: _milky(draw, ior, thickness),
        "principled": lambda: _finish(
            bsdf("principled", spec_trans=1.0, roughness=draw.number(0.15, 0.5), eta=ior,
                 base_color=tint(draw)),
            "rough", "coloured", "principled",
        ),
        "blend": lambda: _finish(
            bsdf("blendbsdf", weight=draw.number(0.2, 0.8), first=_clear(ior),
                 second=_rough(draw, ior)),
            "rough", "blend",
        ),
    }[kind]()  # fmt: skip
    return Glass(made, made)


def clear_glass(draw: Draw) -> Finish:
    """Smooth glass that takes no light."""
    return _finish(_clear(draw.number(1.4, 1.7)), "clear")


def bumpy_glass(draw: Draw, size: float) -> Finish:
    """Smooth glass of uneven surface, for shapes with texture coordinates of their own."""
    relief, files = textures.bitmap(textures.bumps(draw), raw=True)
    element = bsdf(
        "bumpmap", arbitrary=relief, scale=size * draw.number(0.005, 0.02), glass=_clear(1.5)
    )
    return _finish(element, "clear", "bump", "texture", files=files)


def thin_glass(draw: Draw) -> Finish:
    """A sheet of glass without thickness."""
    kind = draw.pick(("plain", "tinted", "rough"))
    if kind == "rough":
        element = bsdf(
            "principledthin", spec_trans=1.0, roughness=draw.number(0.2, 0.5), eta=1.5,
            base_color=tint(draw),
        )  # fmt: skip
        return _finish(element, "rough", "thin", "principled", "coloured")
    if kind == "tinted":
        element = bsdf("thindielectric", int_ior=1.5, specular_transmittance=tint(draw))
        return _finish(element, "clear", "thin", "coloured")
    return _finish(bsdf("thindielectric", int_ior=draw.number(1.4, 1.8)), "clear", "thin")


def absorbing(draw: Draw, thickness: float) -> Medium:
    """What leaves a third to nine tenths of the light that crosses a wall in the faint channel."""
    depth = draw.number(0.1, 1.1)
    r, g, b = (1 - c for c in draw.pick(HUES))
    top = max(r, g, b)
    return Medium((r / top, g / top, b / top), depth / thickness)


def metal(draw: Draw) -> Finish:
    """A polished or rough metal."""
    if draw.chance(0.35):
        return _finish(bsdf("conductor", material=draw.pick(METALS)), "conductor", "polished")
    known = draw.pick(METALS) if draw.chance(0.5) else "none"
    element = bsdf(
        "roughconductor", material=known, distribution=draw.pick(("ggx", "beckmann")),
        alpha=draw.log(0.05, 0.4),
    )  # fmt: skip
    if known == "none":
        element.append(_rgb("specular_reflectance", _shade(draw, 0.5, 0.9)))
    return _finish(element, "conductor")


def paint(draw: Draw) -> Finish:
    """Plastic, lacquer or matt paint."""
    kind = draw.pick(("plastic", "roughplastic", "diffuse", "principled"))
    colour = _shade(draw, 0.05, 0.85)
    if kind == "diffuse":
        return _finish(bsdf("diffuse", reflectance=colour), "matt")
    if kind == "principled":
        element = bsdf(
            "principled", base_color=colour, metallic=draw.number(), roughness=draw.number(0.1, 1),
            clearcoat=draw.number(),
        )  # fmt: skip
        return _finish(element, "principled")
    element = bsdf(kind, diffuse_reflectance=colour, int_ior=1.5)
    if kind == "roughplastic":
        element.append(_number("alpha", draw.log(0.05, 0.3)))
    return _finish(element, "plastic")


def opaque(draw: Draw) -> Finish:
    """Metal or paint."""
    return metal(draw) if draw.chance(0.5) else paint(draw)


def white(draw: Draw) -> Finish:
    """A matt reflector."""
    grey = draw.number(0.8, 0.95)
    return _finish(bsdf("diffuse", reflectance=(grey, grey, grey)), "matt")


def both_sides(one: Finish) -> Finish:
    """An opaque finish for sheets that are seen from either side."""
    return replace(one, bsdf=bsdf("twosided", nested=one.bsdf))


def cloth(draw: Draw) -> Finish:
    """A sheet that reflects and passes light in all directions."""
    colour: RGB | ET.Element
    if draw.chance(0.6):
        picture = textures.weave(draw) if draw.chance(0.5) else textures.stripes(draw)
        colour, files = textures.bitmap(picture)
        traits: tuple[str, ...] = ("texture",)
    else:
        colour, files, traits = _shade(draw, 0.5, 0.95), {}, ()
    woven = bsdf(
        "principledthin", base_color=colour, diff_trans=draw.number(0.6, 1.5), roughness=0.9,
        spec_trans=0.0, eta=1.3,
    )  # fmt: skip
    if draw.chance(0.25):  # gaps between the threads
        woven = bsdf("mask", opacity=draw.number(0.6, 0.9), nested=woven)
        traits += ("mask",)
    return _finish(woven, "cloth", "thin", "principled", *traits, files=files)


def pierced(draw: Draw) -> Finish:
    """An opaque sheet with holes."""
    repeat = draw.whole(1, 4)
    opacity, files = textures.bitmap(textures.holes(draw), raw=True, repeat=repeat)
    opacity.append(_word("filter_type", "nearest"))
    sheet = both_sides(opaque(draw))
    element = bsdf("mask", opacity=opacity, nested=sheet.bsdf)
    return _finish(element, "mask", "texture", "thin", *sheet.traits, files=files)


def tint(draw: Draw) -> RGB:
    """What coloured glass passes: from nearly clear to deep."""
    depth = draw.number(0.2, 1)
    r, g, b = (c**depth for c in draw.pick(HUES))
    return (r, g, b)


def _milky(draw: Draw, ior: float, thickness: float) -> Finish:
    depth = draw.log(0.3, 3)
    r, g, b = (1 - 0.1 * (1 - c) for c in draw.pick(HUES))
    medium = Medium((1.0, 1.0, 1.0), depth / thickness, (r, g, b))
    return _finish(_clear(ior), "clear", "medium", "scattering", medium=medium)


def _clear(ior: float) -> ET.Element:
    return bsdf("dielectric", int_ior=ior, ext_ior=1.0)


def _rough(draw: Draw, ior: float) -> ET.Element:
    return bsdf(
        "roughdielectric", int_ior=ior, ext_ior=1.0, distribution=draw.pick(("ggx", "beckmann")),
        alpha=draw.log(0.03, 0.5),
    )  # fmt: skip


def _finish(
    element: ET.Element, *traits: str, medium: Medium | None = None,
    files: textures.Textures | None = None,
) -> Finish:  # fmt: skip
    return Finish(element, frozenset(traits), medium, files or {})


def _shade(draw: Draw, low: float, high: float) -> RGB:
    return (draw.number(low, high), draw.number(low, high), draw.number(low, high))


def _rgb(name: str, value: RGB) -> ET.Element:
    return ET.Element("rgb", name=name, value=", ".join(f"{v:.6g}" for v in value))


def _number(name: str, value: float) -> ET.Element:
    return ET.Element("float", name=name, value=f"{value:.9g}")


def _word(name: str, value: str) -> ET.Element:
    return ET.Element("string", name=name, value=value)
