"""What lamps are made of, besides `lamp_scene`: measured metals, named glass, paint, cloth."""

from __future__ import annotations

from purelight_examples.luminaires.lamp_scene import RGB, Material


def metal(name: str, alpha: float) -> Material:
    """A metal of measured index (`Au`, `Cu`, `Al`, `Cr`, ...), rough by `alpha`."""
    return Material("roughconductor", {"material": name, "distribution": "ggx", "alpha": alpha}, {})


def tinted_metal(color: RGB, alpha: float) -> Material:
    """A patinated or lacquered metal of a colour."""
    return Material(
        "roughconductor", {"material": "none", "distribution": "ggx", "alpha": alpha},
        {"specular_reflectance": color},
    )  # fmt: skip


def glass(index: str | float = "bk7", tint: RGB = (1.0, 1.0, 1.0)) -> Material:
    """Smooth glass of a kind that Mitsuba has the index of; `tint` is passed at each face."""
    return Material(
        "dielectric", {"int_ior": index, "ext_ior": 1.000277}, {"specular_transmittance": tint}
    )


def rough_glass(alpha: float, tint: RGB = (1.0, 1.0, 1.0), index: str = "bk7") -> Material:
    """Glass with a rough face, etched or sandblasted."""
    values: dict[str, float | str] = {
        "int_ior": index, "ext_ior": "air", "distribution": "ggx", "alpha": alpha,
    }  # fmt: skip
    return Material("roughdielectric", values, {"specular_transmittance": tint})


def matt_paint(reflectance: RGB) -> Material:
    """Paint that reflects light evenly."""
    return Material("diffuse", {}, {"reflectance": reflectance})


def glaze(color: RGB, alpha: float = 0.08) -> Material:
    """Glazed ceramic or lacquer: colour below a smooth coat."""
    return Material(
        "roughplastic", {"alpha": alpha, "int_ior": 1.5}, {"diffuse_reflectance": color}
    )


def fabric(color: RGB, through: float = 1.0) -> Material:
    """A thin cloth that reflects and passes light in all directions.

    Arguments:
        through: 0 for all light reflected to 2 for all light passed.
    """
    values: dict[str, float | str] = {
        "diff_trans": through, "roughness": 0.9, "spec_trans": 0.0, "eta": 1.3,
    }  # fmt: skip
    return Material("principledthin", values, {"base_color": color})


BK7 = glass()
ACRYLIC = glass("acrylic glass")
GOLD = metal("Au", 0.1)
COPPER = metal("Cu", 0.15)
ALUMINIUM = metal("Al", 0.2)
MIRROR = metal("Al", 0.03)
CHROME = metal("Cr", 0.08)
WHITE = matt_paint((0.85, 0.85, 0.83))
IRON = matt_paint((0.14, 0.13, 0.12))
PHOSPHOR = matt_paint((0.8, 0.75, 0.6))
BLACK = matt_paint((0.04, 0.04, 0.04))
BRUSHED = tinted_metal((0.6, 0.6, 0.6), 0.22)
