"""Single objects of a Mitsuba scene, as Mitsuba loads them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from purelight_import.read import mitsuba_files
from purelight_import.read.mitsuba05 import SEPARATORS


def scalar_mitsuba() -> Any:
    """Mitsuba without a just-in-time compiler, which reading does not need."""
    from purelight_mitsuba import platform

    platform.prepare()
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def load(mi: Any, element: ET.Element) -> Any:
    """A shape, or an emitter without one.

    Raises:
        PureLightError: it names a file that cannot be read.
        RuntimeError: Mitsuba does not understand it.
    """
    mitsuba_files.find_files(element)
    in_line(element)
    scene = ET.Element("scene", version="3.0.0")
    scene.append(element)
    loaded = mi.load_string(ET.tostring(scene, encoding="unicode"), parallel=False, optimize=False)
    return (loaded.shapes() or loaded.emitters())[0]


def in_line(element: ET.Element) -> None:
    """Writes tabulated spectra as one value, which Mitsuba turns into a colour; not so plugins."""
    for spectrum in element.iter("spectrum"):
        if spectrum.get("type") not in ("regular", "irregular"):
            continue
        values = {e.get("name"): e.get("value", "") for e in spectrum}
        power = _numbers(values.get("values", ""))
        if spectrum.get("type") == "irregular":
            at = _numbers(values.get("wavelengths", ""))
        else:
            low, high = (float(values.get(f"wavelength_{end}", "nan")) for end in ("min", "max"))
            at = np.linspace(low, high, len(power)).tolist()
        if len(at) != len(power) or not np.isfinite(at + power).all():
            raise ValueError(f"the spectrum '{spectrum.get('name', '')}' lacks wavelengths")
        name = spectrum.get("name", "")
        pairs = ", ".join(f"{w:.9g}:{p:.9g}" for w, p in zip(at, power, strict=True))
        spectrum.clear()
        spectrum.attrib.update({"name": name, "value": pairs})


def _numbers(text: str) -> list[float]:
    return [float(x) for x in SEPARATORS.split(text.strip()) if x]
