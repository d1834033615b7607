"""Lamps of other formats, brought in as Mitsuba scenes that can be read, edited and trained."""

from __future__ import annotations

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.options import Options

__all__ = ["Lamp", "Material", "Options", "Part", "import_lamp", "read_lamp"]


def __getattr__(name: str) -> object:
    """The functions, which load the libraries that they need."""
    if name in ("import_lamp", "read_lamp"):
        from purelight_import import importing

        return getattr(importing, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
