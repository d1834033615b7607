"""Which anchors suit a lamp: short trials, judged by the likelihood of light kept from them."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from purelight_train.learning.photon_batches import PhotonBatches
from purelight_train.networks.student import Student
from purelight_train.presets import ANCHORS, Optimisation, Preset
from purelight_train.runs.evaluation import as_function, held_out_gain
from purelight_train.runs.optimisation import optimise
from purelight_train.runs.routes import photon_objective
from purelight_train.runs.traced_lamp import TracedLamp

STEPS = 300  # or a third of the schedule, where that is less


def choose_anchor(lamp: TracedLamp, preset: Preset) -> tuple[str, dict[str, float]]:
    """The anchors under which a student of a few steps gives held-out light the best likelihood.

    A lamp whose exit surface refracts nothing has no refracted ray to try. The trials see the same
    photons from the same weights on, so that luck plays no part; the route `photons` is used
    whatever the lamp is trained by.

    Returns:
        the choice, and the likelihoods in nats over a uniform Lambertian surface.
    """
    names = [
        n for n, kinds in ANCHORS.items() if lamp.description.index > 1 or "refracted" not in kinds
    ]
    batches = lamp.photon_batches(preset)
    with lamp.stages.bar("anchor", len(names), "trial") as update:
        tried = {}
        for done, name in enumerate(names, 1):
            batches.restart()
            own = preset.for_route("photons", anchor=name)
            tried[name] = round(_trial(lamp, own, batches), 4)
            update(done)
    return max(tried, key=lambda name: tried[name]), tried


def _trial(lamp: TracedLamp, preset: Preset, batches: PhotonBatches) -> float:
    """Held-out gain in nats of a student after a whole, short schedule."""
    stages, description = lamp.stages, lamp.description
    student = stages.build("student", Student, description, preset)
    settings: Optimisation = replace(
        preset.photons, steps=min(STEPS, preset.photons.steps // 3 + 1)
    )
    with tempfile.TemporaryDirectory() as folder:
        optimise(
            student, photon_objective(student, lamp, preset, batches), settings, stages.seed,
            Path(folder) / "trial.safetensors", lambda *_: None,
        )  # fmt: skip
    return held_out_gain(as_function(student, stages.device), lamp)
