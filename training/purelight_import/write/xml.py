"""Small pieces of Mitsuba's XML."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def number(parent: ET.Element, name: str, value: float) -> None:
    """Adds a parameter that is a number."""
    ET.SubElement(parent, "float", name=name, value=f"{value:.9g}")


def text(parent: ET.Element, name: str, value: str) -> None:
    """Adds a parameter that is a word."""
    ET.SubElement(parent, "string", name=name, value=value)


def flag(parent: ET.Element, name: str, *, value: bool) -> None:
    """Adds a parameter that is true or false."""
    ET.SubElement(parent, "boolean", name=name, value=str(value).lower())


def color(parent: ET.Element, name: str, value: Iterable[float]) -> None:
    """Adds a parameter that is a linear colour."""
    ET.SubElement(parent, "rgb", name=name, value=", ".join(f"{v:.9g}" for v in value))


def matrix(parent: ET.Element, name: str, value: NDArray[np.float64]) -> None:
    """Adds a transform [4, 4]."""
    transform = ET.SubElement(parent, "transform", name=name)
    ET.SubElement(transform, "matrix", value=" ".join(f"{v:.9g}" for v in value.ravel()))


def comment(words: str) -> Any:
    """A comment, in which two hyphens must not follow each other."""
    shown = "".join(c if c.isprintable() else " " for c in words)
    return ET.Comment(f" {re.sub('-{2,}', '-', shown).strip('-')} ")
