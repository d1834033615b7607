"""Mitsuba's materials as LuxCore's, where both have the same formula."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError

Properties = dict[str, list[Any]]
SMOOTH = 1e-3  # roughness of what is smooth, where LuxCore has it only rough


def material(bsdf: mi.BSDF, name: str) -> Properties:
    """Properties of a LuxCore material without their prefix.

    Raises:
        PureLightError: LuxCore has none of the same formula.
    """
    kind, values = bsdf.class_name(), _values(bsdf)
    if kind == "TwoSidedBRDF":
        kind, values = _inner(bsdf, values)
    makers = {
        "SmoothDiffuse": _matt, "SmoothDielectric": _glass, "RoughDielectric": _rough_glass,
        "SmoothConductor": _metal, "RoughConductor": _metal,
    }  # fmt: skip
    if kind not in makers:
        raise PureLightError(f"LuxCore has no material like {kind} of shape {name}")
    if any(k.endswith((".data", ".to_uv")) for k in values):
        raise PureLightError(f"the texture of shape {name} is not converted for LuxCore")
    if kind.startswith("Rough") and "distribution = ggx" not in str(bsdf):
        raise PureLightError(f"shape {name}: LuxCore has no Beckmann distribution, only GGX's")
    return makers[kind](values, name)


def require_visible(materials: dict[str, Properties]) -> None:
    """Refuse lamps that a camera would see otherwise than in Mitsuba.

    LuxCore's smooth glass scales radiance by the squared index on paths from the camera and its
    rough glass does not, so that a hollow lamp of both is twice as bright; with the smooth faces
    made rough by 0.001 a globe of roughness 0.35 is still a quarter too bright. Light on other
    surfaces is not concerned: it comes on paths from the lamp.

    Raises:
        PureLightError: there is rough glass.
    """
    if any(own["type"] == ["roughglass"] for own in materials.values()):
        raise PureLightError(
            "LuxCore shows rough glass brighter than Mitsuba does where a camera looks at it; only "
            "the light on other surfaces can be compared"
        )


def _values(bsdf: mi.BSDF) -> dict[str, Any]:
    found = mi.traverse(bsdf)
    return {key: found[key] for key in found.keys()}  # noqa: SIM118 - not a dict


def _inner(bsdf: mi.BSDF, values: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """What a two-sided material has on both sides; LuxCore's opaque ones are two-sided."""
    text = str(bsdf)
    kinds = {"Diffuse[": "SmoothDiffuse", "RoughConductor[": "RoughConductor",
             "SmoothConductor[": "SmoothConductor"}  # fmt: skip
    kind = next((made for word, made in kinds.items() if word in text), "TwoSidedBRDF")
    return kind, {key.removeprefix("brdf_0."): v for key, v in values.items()}


def _color(values: dict[str, Any], key: str, usual: float = 1.0) -> list[float]:
    found = np.ravel(np.array(values.get(f"{key}.value", usual), np.float64))
    return [float(v) for v in np.broadcast_to(found, 3)]


def _number(values: dict[str, Any], key: str) -> float:
    return float(np.ravel(np.array(values[key]))[0])


def _matt(values: dict[str, Any], _: str) -> Properties:
    return {"type": ["matte"], "kd": _color(values, "reflectance")}


def _faces(values: dict[str, Any]) -> Properties:
    return {
        "kr": _color(values, "specular_reflectance"),
        "kt": _color(values, "specular_transmittance"),
        "interiorior": [_number(values, "eta")],
        "exteriorior": [1.0],
    }


def _glass(values: dict[str, Any], _: str) -> Properties:
    return {"type": ["glass"], **_faces(values)}


def _rough_glass(values: dict[str, Any], _: str) -> Properties:
    alpha = _number(values, "alpha.value")
    return {
        "type": ["roughglass"], **_faces(values), "uroughness": [alpha], "vroughness": [alpha],
    }  # fmt: skip


def _metal(values: dict[str, Any], name: str) -> Properties:
    """By the index where there is one; of a colour, its reflectance when seen head-on."""
    alpha = _number(values, "alpha.value") if "alpha.value" in values else SMOOTH
    rough: dict[str, list[Any]] = {"type": ["metal2"], "uroughness": [alpha], "vroughness": [alpha]}
    eta, k = (np.array(_color(values, key)) for key in ("eta", "k"))
    tint = np.array(_color(values, "specular_reflectance"))
    if not eta.any():  # `none`: a mirror of a colour
        if alpha == SMOOTH:
            return {"type": ["mirror"], "kr": tint.tolist()}
        eta, k = _of_color(tint)
    elif not np.allclose(tint, 1):
        raise PureLightError(f"the tint of the metal of shape {name} is not converted for LuxCore")
    return rough | {"n": eta.tolist(), "k": k.tolist()}


def _of_color(color: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r"""Real index 1 and the k that reflects so much head-on: :math:`R = k^2 / (4 + k^2)`."""
    held = np.clip(color, 0, 0.999)
    return np.ones(3), 2 * np.sqrt(held / (1 - held))
