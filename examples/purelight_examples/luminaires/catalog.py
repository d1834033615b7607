"""The lamps of the gallery by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from purelight_examples.luminaires.cluster import Cluster
from purelight_examples.luminaires.crystal import Crystal
from purelight_examples.luminaires.downlight import Downlight
from purelight_examples.luminaires.filament_bulb import FilamentBulb
from purelight_examples.luminaires.flower import Flower
from purelight_examples.luminaires.frosted_globe import FrostedGlobe
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.linear_led import LinearLed
from purelight_examples.luminaires.medieval import Medieval
from purelight_examples.luminaires.modern import Modern
from purelight_examples.luminaires.street_light import StreetLight
from purelight_examples.luminaires.table_lamp import TableLamp
from purelight_examples.luminaires.vintage import Vintage
from purelight_examples.luminaires.wall_sconce import WallSconce

Mount = Literal["hung", "ceiling", "recess", "wall", "table", "pole"]


@dataclass(frozen=True)
class Entry:
    """A lamp of the gallery.

    Arguments:
        title: what it is called.
        mount: how it is fixed; `wall` lamps have the wall at x = 0.
        azimuth, elevation: from where it is looked at, in degrees.
    """

    lamp: Lamp
    title: str
    mount: Mount
    azimuth: float = 35.0
    elevation: float = -12.0


_ENTRIES = (
    Entry(Cluster(), "Cluster", "hung"),
    Entry(Crystal(), "Crystal", "ceiling", 20.0, -10.0),
    Entry(Medieval(), "Medieval", "hung", 20.0, -8.0),
    Entry(Modern(), "Modern", "hung"),
    Entry(Flower(), "Rough Flower", "hung", 35.0, -25.0),
    Entry(Flower("flower_specular", 0.04), "Specular Flower", "hung", 35.0, -25.0),
    Entry(Vintage(), "Vintage Simple", "ceiling", 35.0, -20.0),
    Entry(Vintage("vintage_complex", True), "Vintage Complex", "ceiling", 35.0, -20.0),
    Entry(Downlight(), "LED downlight", "recess", 35.0, -50.0),
    Entry(LinearLed(), "Linear LED", "ceiling", 60.0, -40.0),
    Entry(StreetLight(), "Street light", "pole", 150.0, -35.0),
    Entry(WallSconce(), "Wall sconce", "wall", 30.0, 8.0),
    Entry(TableLamp(), "Table lamp", "table", 35.0, -4.0),
    Entry(FilamentBulb(), "Filament bulb", "hung", -65.0, 4.0),
    Entry(FrostedGlobe(), "Frosted globe", "hung", -65.0, 4.0),
)
CATALOG = {entry.lamp.name: entry for entry in _ENTRIES}
