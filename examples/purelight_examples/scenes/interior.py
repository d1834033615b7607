"""What every room of the gallery has in common: lamps at places, a camera, a window."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.luminaires.lamp_scene import Part, matt, write_parts, write_xml
from purelight_examples.scenes.lamp_choice import LampChoice, Point
from purelight_examples.scenes.place import Place, placed
from purelight_examples.scenes.sensor import Picture, sensor
from purelight_format.errors import PureLightError

SKY = (0.75, 0.9, 1.0)  # colour of a window's light
CLEAR = 0.002  # between a lamp and what it is fixed to


@dataclass(frozen=True)
class View:
    """Where a camera stands, what it looks at, and its field of view in degrees."""

    origin: Point
    target: Point
    fov: float = 60.0


class Interior(ABC):
    """A room, its floor at z = 0, lit by lamps of the catalog and, if wished, by a window.

    Its measures and lamps are the fields of a frozen dataclass, two of which are its name and the
    radiance of the window in W/(m² sr), 0 at night.
    """

    name: str
    daylight: float

    @abstractmethod
    def view(self) -> View:
        """The camera."""

    @abstractmethod
    def parts(self) -> list[Part]:
        """The room's meshes by material, without its lamps."""

    @abstractmethod
    def places(self) -> dict[str, list[Place]]:
        """Where lamps are, by their names in the catalog."""

    def window(self) -> trimesh.Trimesh | None:
        """The pane that daylight comes from, its normal into the room; none without one."""
        return None

    def write(
        self, folder: Path, lamps: Mapping[str, LampChoice], picture: Picture | None = None,
        name: str = "",
    ) -> Path:  # fmt: skip
        """Write the scene and its meshes; returns the XML's path.

        Arguments:
            lamps: what to put at the places, by name; all on one integrator.
            name: of the XML, the room's own by default.

        Raises:
            PureLightError: a lamp of `places` is missing.
        """
        places = self.places()
        if missing := [lamp for lamp in places if lamp not in lamps]:
            raise PureLightError(f"{self.name}: needs a lamp for {', '.join(missing)}")
        scene = ET.Element("scene", version="3.0.0")
        scene.append(lamps[next(iter(places))].integrator())
        view = self.view()
        scene.append(sensor(picture or Picture(), view.origin, view.target, view.fov))
        scene.extend(write_parts(folder, self.name, [*self.parts(), *self._pane()]))
        hung = [(lamp, place) for lamp, found in places.items() for place in found]
        for number, (lamp, place) in enumerate(hung):
            scene.extend(placed(lamps[lamp], place, folder, number))
        return write_xml(folder / f"{name or self.name}.xml", scene)

    def _pane(self) -> list[Part]:
        pane = self.window()
        if pane is None:
            return []
        if self.daylight <= 0:
            return [matt("pane", pane, (0.02, 0.025, 0.04))]
        r, g, b = (self.daylight * c for c in SKY)
        return [Part("pane", pane, matt("", pane, (0.1, 0.1, 0.1)).material, (r, g, b))]


@cache
def reach(lamp: str) -> tuple[float, float]:
    """Lowest and highest z of a lamp of the catalog in metres."""
    bounds = np.array([part.mesh.bounds for part in CATALOG[lamp].lamp.parts()])
    return float(bounds[:, 0, 2].min()), float(bounds[:, 1, 2].max())


def hung(lamp: str, x: float, y: float, ceiling: float, drop: float = 0.0, turn: float = 0.0,
         scale: float = 1.0) -> Place:  # fmt: skip
    """A lamp whose top is `drop` below the ceiling."""
    return Place((x, y, ceiling - CLEAR - drop - scale * reach(lamp)[1]), turn, scale)


def stood(lamp: str, x: float, y: float, floor: float, turn: float = 0.0) -> Place:
    """A lamp that stands on something."""
    return Place((x, y, floor + CLEAR - reach(lamp)[0]), turn)


def cord(place: Place, ceiling: float, lamp: str) -> trimesh.Trimesh:
    """What a lamp hangs on, from just above it to the ceiling."""
    low = place.at[2] + place.scale * reach(lamp)[1] + CLEAR
    rod = trimesh.creation.cylinder(0.003, ceiling - low, sections=12)
    return rod.apply_translation([place.at[0], place.at[1], 0.5 * (ceiling + low)])
