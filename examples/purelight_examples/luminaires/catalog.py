"""The lamps of the gallery by name."""

from __future__ import annotations

from dataclasses import dataclass

from purelight_examples.luminaires.cluster import Cluster
from purelight_examples.luminaires.downlight import Downlight
from purelight_examples.luminaires.flower import Flower
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.linear_led import LinearLed
from purelight_examples.luminaires.medieval import Medieval
from purelight_examples.luminaires.modern import Modern
from purelight_examples.luminaires.street_light import StreetLight
from purelight_examples.luminaires.table_lamp import TableLamp
from purelight_examples.luminaires.vintage import Vintage
from purelight_examples.luminaires.wall_sconce import WallSconce


@dataclass(frozen=True)
class Entry:
    lamp: Lamp
    views: tuple[tuple[float, float], ...] = ((35.0, -12.0),)


CATALOG = {
    "cluster": Entry(Cluster()),
    "medieval": Entry(Medieval()),
    "modern": Entry(Modern()),
    "flower_rough": Entry(Flower(), ((35.0, -25.0),)),
    "flower_specular": Entry(Flower("flower_specular", 0.04), ((35.0, -25.0),)),
    "vintage_simple": Entry(Vintage(), ((35.0, -20.0),)),
    "vintage_complex": Entry(Vintage("vintage_complex", True), ((35.0, -20.0),)),
    "downlight": Entry(Downlight(), ((35.0, -40.0),)),
    "linear_led": Entry(LinearLed(), ((65.0, -25.0),)),
    "street_light": Entry(StreetLight(), ((150.0, -35.0),)),
    "wall_sconce": Entry(WallSconce(), ((30.0, 8.0),)),
    "table_lamp": Entry(TableLamp(), ((35.0, -8.0),)),
}
