"""What a benchmark asks of a system: make ready for a lamp once, then draw pictures of a task.

A *task* is a scene in which a lamp stands, and a camera. A *system* is a way to have the lamp's
light in it: our networks, the real lamp by some integrator, or a rival's representation. Whatever a
system is, it is judged by its pictures alone, beside the same truth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from purelight_examples.scenes.lamp_choice import LampChoice

Image = NDArray[np.float64]  # linear RGB radiance in W/(m² sr): [height, width, 3]


@dataclass(frozen=True)
class Subject:
    """A lamp that all systems are asked for.

    Arguments:
        name: of the lamp, and of its folder.
        scene: Mitsuba XML of the real lamp.
        run: of `purelight-train`.
        bundle: that was exported from it.
        centre, radius: bounding sphere, in m.
        flux: radiant flux in W: RGB.
        threads: processor threads that a system may use.
    """

    name: str
    scene: Path
    run: Path
    bundle: Path
    centre: tuple[float, float, float]
    radius: float
    flux: tuple[float, float, float]
    threads: int = 1


class Task(Protocol):
    """A scene with a place for a lamp, and a camera.

    Arguments:
        name: `room`, `floor`, `views`, `glare`, ...
        kind: `illumination` if what is judged is lit by the lamp, `appearance` if it is the lamp.
    """

    name: str
    kind: str

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """Write the scene with this lamp in it as Mitsuba XML into a folder; returns its path."""
        ...


@dataclass(frozen=True)
class Cost:
    """What a system needed before its first picture of a lamp.

    Arguments:
        seconds: processor seconds, all stages, tracing of light included.
        megabytes: of what a host has to hold for the lamp, as stored.
        parts: both by stage, and whatever else should be told.
    """

    seconds: float
    megabytes: float
    parts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Frame:
    """A picture by a number of independent passes so far.

    Arguments:
        image: their mean.
        samples: per pixel in all, or what stands for them (`unit` of the system).
        seconds: wall-clock seconds of all passes, without loading and compiling.
        warm_up: seconds of loading and compiling.
        megabytes: peak resident memory of the process that renders, if it is the system's alone.
        processor: processor seconds of all passes, which other work on the machine hardly changes;
            None if not known. With one thread it stands for `seconds` in tables and fronts.
    """

    image: Image
    samples: int
    seconds: float
    warm_up: float
    megabytes: float | None = None
    processor: float | None = None


class System(Protocol):
    """A way to have a lamp's light in a scene.

    Arguments:
        name: short, a row of the tables and a name of files: letters, digits and `_`.
        label: what it is and whose, in a line: "NCL (Zhu et al. 2021), re-implemented: ...".
        answers: kinds of task that it can do.
    """

    @property
    def name(self) -> str: ...

    @property
    def label(self) -> str: ...

    @property
    def answers(self) -> tuple[str, ...]: ...

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Make ready for a lamp in a folder of its own; does nothing again that is there.

        Raises:
            PureLightError: it cannot do this lamp, with the reason.
        """
        ...

    def frames(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        """Pictures of a task at growing counts of samples per pixel, each going on from the last.

        Raises:
            PureLightError: it cannot do this task, with the reason.
        """
        ...
