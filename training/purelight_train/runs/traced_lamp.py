"""A lamp and the light that was traced out of it, made when first needed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.members.finishes import to_json
from purelight_format.ray_file.files import is_ray_file
from purelight_train.fragment import copied, kept_beside
from purelight_train.learning.photon_batches import PhotonBatches
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.description import Description
from purelight_train.light.emission import Emission
from purelight_train.light.exit_records import ExitRecords, escaped_part, settle, triangle_flux
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.finishes import finished
from purelight_train.light.kept import kept_parts
from purelight_train.light.light_tracing import BATCH
from purelight_train.light.lighter import chosen_of, lighter
from purelight_train.light.luminaire import Luminaire, load_luminaire
from purelight_train.light.measured_luminaire import MeasuredLuminaire, load_measured
from purelight_train.light.virtual_surface import AUTO
from purelight_train.presets import Preset
from purelight_train.runs.stages import Stages

HELD_OUT = 1 << 17
ESCAPED = 1 << 19
NEEDLES = 5e-3


@dataclass
class TracedLamp:
    """The lamp of one run.

    Arguments:
        scene: Mitsuba scene of the lamp, or a ray file of its light.
        paths: emitted paths whose records are kept.
        exit_surface: where measured rays leave the lamp (`measured_luminaire.load_measured`).
        tolerance: of a scene's exit surface (`decimation`).
    """

    scene: Path
    paths: int
    stages: Stages
    exit_surface: str = AUTO
    tolerance: float = 0.0

    @cached_property
    def luminaire(self) -> Luminaire | MeasuredLuminaire:
        if is_ray_file(self.scene):
            return load_measured(self.scene, self.stages.seed, self.exit_surface)
        return lighter(self._whole, self.tolerance)

    @cached_property
    def _whole(self) -> Luminaire:
        """The lamp of a scene with all of its triangles."""
        return load_luminaire(self.scene, self.stages.seed)

    @property
    def modelled(self) -> Luminaire:
        """The lamp as its scene describes it.

        Raises:
            PureLightError: There are measured rays in place of a scene.
        """
        if isinstance(self.luminaire, MeasuredLuminaire):
            raise PureLightError(
                f"{self.scene}: measured rays tell nothing of the lamp's materials"
            )
        return self.luminaire

    @property
    def surface(self) -> ExitSurface:
        return self.luminaire.exit_surface

    @property
    def emission(self) -> Emission | MeasuredLuminaire:
        return self.luminaire.emission

    @cached_property
    def _traced(self) -> tuple[Description, ExitRecords, NDArray[np.int64]]:
        """What was found of the lamp, the light that a viewer meets, and the triangle it left."""
        with self.stages.bar("light", -(-self.paths // BATCH) * BATCH, "path") as update:
            records = self.luminaire.trace(self.paths, self.stages.seed + 1, update)
        _require_radiance(records)
        description = Description.of(records, self.luminaire)
        return description, *settle(records, self.surface)

    @property
    def records(self) -> ExitRecords:
        """The light kept for flux and photon map, as a viewer meets it."""
        return self._traced[1]

    @cached_property
    def reference_rays(self) -> ReferenceRays:
        """Rays to compare photons with, drawn where the light is."""
        _, records, triangle = self._traced
        return ReferenceRays.of(self.surface, records, triangle)

    def photon_batches(self, preset: Preset) -> PhotonBatches:
        """Endless photons and reference rays to learn from."""
        references = replace(self.reference_rays, light_share=preset.reference_light)
        device = self.stages.device
        return PhotonBatches(self.luminaire, self.description, references, device)

    @cached_property
    def held_out(self) -> ExitRecords:
        """Light that no network is trained on, as a viewer meets it."""
        seed = self.stages.seed + 100_003
        settled = settle(self.luminaire.held_out(seed), self.surface)[0]
        # Light that escapes comes first
        order = np.random.default_rng(seed).permutation(len(settled))
        return settled.take(order[:HELD_OUT])

    @cached_property
    def description(self) -> Description:
        """From the run directory if it is there, which spares a resumed run the tracing."""
        run = self.stages.run
        if (run.path / "escaped.npz").is_file():
            return run.description
        return self._traced[0]

    def store(self) -> None:
        """Store what the exporter needs of the lamp itself, unless it is stored."""
        run = self.stages.run
        if (run.path / "escaped.npz").is_file():
            return
        description, records, triangle = self._traced
        run.write_json("description.json", description.to_dict())
        self._store_kept()
        run.write_arrays(
            "surface.npz",
            positions=self.surface.positions,
            triangles=self.surface.triangles,
            triangle_flux=triangle_flux(records, triangle, len(self.surface.triangles)),
            **self._finish(),
        )
        direction, weight = escaped_part(records, description.flux, ESCAPED)
        run.write_arrays("escaped.npz", direction=direction, weight=weight)

    def _store_kept(self) -> None:
        """Store the parts that are kept out of the networks, if there are any."""
        run, scene = self.stages.run, kept_beside(self.scene)
        if scene is None:
            return
        parts = kept_parts(scene)
        copied(scene, run.path / "kept")
        run.write_json("kept.json", to_json([part.finish for part in parts]))
        arrays = {
            f"{field}_{k}": value
            for k, part in enumerate(parts)
            for field in ("positions", "triangles", "normals")
            if (value := getattr(part, field)) is not None
        }
        run.write_arrays("kept.npz", **arrays)

    def _finish(self) -> dict[str, NDArray[Any]]:
        """Of what each triangle is made, and in the run directory what that is.

        Measured rays do not tell.
        """
        if isinstance(self.luminaire, MeasuredLuminaire):
            return {}
        made = finished(self._whole)
        self.stages.run.write_json("finishes.json", to_json(made.finishes))
        return {"finish": made.sides[chosen_of(self._whole.exit_surface, self.surface)]}


def _require_radiance(records: ExitRecords) -> None:
    """Refuse a lamp that sends out infinitely thin rays: no network could tell its radiance.

    Raises:
        PureLightError: more than `NEEDLES` of its light is of that kind.
    """
    share = records.needles / (records.flux.sum() * records.paths)
    if share > NEEDLES:
        raise PureLightError(
            f"{100 * share:.3g} % of the lamp's light comes from emitters without area (point, "
            "spot) through nothing that scatters it, so it has no radiance; make them small "
            "spheres with an area light"
        )
