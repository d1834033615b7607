"""A lamp and the light that was traced out of it, made when first needed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_train.light.description import Description
from purelight_train.light.exit_records import ExitRecords, escaped_part, settle, triangle_flux
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.light_tracing import BATCH, trace_records
from purelight_train.light.luminaire import Luminaire, load_luminaire
from purelight_train.runs.stages import Stages

HELD_OUT = 1 << 17
ESCAPED = 1 << 19


@dataclass
class TracedLamp:
    """The lamp of one run.

    Arguments:
        scene: Mitsuba scene of the lamp.
        paths: emitted paths whose records are kept.
    """

    scene: Path
    paths: int
    stages: Stages

    @cached_property
    def luminaire(self) -> Luminaire:
        return load_luminaire(self.scene, self.stages.seed)

    @property
    def surface(self) -> ExitSurface:
        return self.luminaire.exit_surface

    @cached_property
    def traced(self) -> tuple[ExitRecords, NDArray[np.int64]]:
        """The records kept, and the triangle each left."""
        with self.stages.bar("light", -(-self.paths // BATCH) * BATCH, "path") as update:
            records = trace_records(self.luminaire.scene, self.paths, self.stages.seed + 1, update)
        return settle(records, self.surface)

    @cached_property
    def held_out(self) -> ExitRecords:
        """Records that no network is trained on."""
        records = trace_records(self.luminaire.scene, BATCH, self.stages.seed + 100_003)
        return settle(records, self.surface)[0].take(slice(HELD_OUT))

    @cached_property
    def description(self) -> Description:
        """From the run directory if it is there, which spares a resumed run the tracing."""
        run = self.stages.run
        if (run.path / "escaped.npz").is_file():
            return run.description
        return Description.of(self.traced[0], self.surface)

    def store(self) -> None:
        """Store what the exporter needs of the lamp itself, unless it is stored."""
        run = self.stages.run
        if (run.path / "escaped.npz").is_file():
            return
        records, triangle = self.traced
        run.write_json("description.json", self.description.to_dict())
        run.write_arrays(
            "surface.npz",
            positions=self.surface.positions,
            triangles=self.surface.triangles,
            triangle_flux=triangle_flux(records, triangle, len(self.surface.triangles)),
        )
        direction, weight = escaped_part(records, ESCAPED)
        run.write_arrays("escaped.npz", direction=direction, weight=weight)
