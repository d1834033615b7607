"""Systems of other people, and of the paper, on our lamps; each says what it is."""

from benchmarks.systems.protocol import System
from benchmarks.systems.rivals.bidirectional.system import Bidirectional
from benchmarks.systems.rivals.distilled import Distilled
from benchmarks.systems.rivals.histogram import Histogram
from benchmarks.systems.rivals.ies import Ies
from benchmarks.systems.rivals.ncl import Ncl, NclLightTraced
from benchmarks.systems.rivals.rays import Rays
from benchmarks.systems.rivals.shells import Shell4D, ShellFactorised
from benchmarks.systems.rivals.teacher import Teacher
from benchmarks.systems.rivals.wcl.system import Wcl

RIVALS: tuple[System, ...] = (
    Bidirectional(),
    Ncl(),
    NclLightTraced(),
    Wcl(),
    Ies(),
    Rays(1_000_000),
    Rays(10_000_000),
    Distilled(),
    Teacher(),
    Histogram(),
    Shell4D(),
    ShellFactorised(),
)
