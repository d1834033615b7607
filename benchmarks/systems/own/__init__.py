"""The real lamp by Mitsuba's own integrators, and PureLight."""

from benchmarks.systems.own.purelight import PureLight
from benchmarks.systems.own.real import LightTracing, PathTracing
from benchmarks.systems.own.trained_by import TrainedBy
from benchmarks.systems.protocol import System

OWN: tuple[System, ...] = (
    PathTracing(),
    LightTracing(),
    PureLight("accurate"),
    PureLight("fast"),
    TrainedBy("draft"),
    TrainedBy("draft", "fast"),
)
