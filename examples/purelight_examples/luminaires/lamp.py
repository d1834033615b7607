"""What every lamp of the gallery has in common: a name, parts, and a scene to write."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path

from purelight_examples.luminaires.lamp_scene import Part, write_scene


class Lamp(ABC):
    """A lamp made by code. Lengths are metres, light is lumens of a colour temperature in kelvin.

    Its parameters are the fields of a frozen dataclass, of which `name` is one.
    """

    name: str

    @abstractmethod
    def parts(self) -> list[Part]:
        """The lamp's parts: closed meshes, materials, and what shines."""

    def write(self, folder: Path) -> Path:
        """Write `<name>.xml` and its meshes; returns the XML's path."""
        return write_scene(folder, self.name, self.parts())
