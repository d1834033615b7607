"""A run of our training on a surface around the lamp, in place of the lamp's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from torch import nn

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.subjects import ALL_PRESETS
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_train.fragment import kept_beside
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.luminaire import Luminaire, load_luminaire
from purelight_train.presets import PRESETS, Preset
from purelight_train.runs.pipeline import Training
from purelight_train.runs.routes import Route
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import Stages
from purelight_train.runs.traced_lamp import TracedLamp
from purelight_train.runs.trained import STUDENT, TRANSPARENCY
from purelight_train.runs.trainer import Trained

MARGIN = 1.004  # so that the facets of the sphere enclose the lamp's bounding sphere
SUBDIVISIONS = 4
SEED = 0
OWN_STAGES = ("student", "transparency", "cap", "pilot", "aim", "sampler", "fast_map")


class ProxyLamp(TracedLamp):
    """The lamp of a scene, whose light is told on a surface laid around it."""

    around: Callable[[ExitSurface], trimesh.Trimesh]

    @cached_property
    def luminaire(self) -> Luminaire:
        lamp = load_luminaire(self.scene, self.stages.seed)
        mesh = self.around(lamp.exit_surface)
        surface = ExitSurface(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32),
            np.zeros(len(mesh.faces), bool), virtual=np.ones(len(mesh.faces), bool),
        )  # fmt: skip
        return replace(lamp, exit_surface=surface, index=1.0)

    def _finish(self) -> dict[str, NDArray[Any]]:
        """A proxy is made of nothing."""
        return {}


class ProxyTraining(Training):
    """A run of which some networks come from elsewhere."""

    def adopt(self, name: str, module: nn.Module) -> None:
        """Take a module for a network of the run, which is not trained then."""
        self._networks[name] = module


def sphere_around(surface: ExitSurface) -> trimesh.Trimesh:
    """An icosphere around a lamp."""
    about: BoundingSphere = surface.sphere
    mesh = trimesh.creation.icosphere(SUBDIVISIONS, MARGIN * about.radius)
    return mesh.apply_translation(about.center)


def base_preset(subject: Subject) -> Preset:
    """The sizes that the subject's run was begun with, of no route yet."""
    run = RunDirectory.open(subject.run).preset
    known = ALL_PRESETS.get(run.name, PRESETS.get(run.name, run))
    return replace(known, anchor="none", anchor_grid=None, student_link="log1p")


def proxy_run(
    subject: Subject,
    folder: Path,
    route: type[Route],
    preset: Preset,
    around: Callable[[ExitSurface], trimesh.Trimesh] = sphere_around,
) -> ProxyTraining:
    """A run in a folder of its own, begun or gone on with.

    Raises:
        PureLightError: parts of the lamp are kept as ordinary geometry, which a proxy would hide.
    """
    if kept_beside(subject.scene):
        raise PureLightError(f"{subject.name}: a proxy cannot enclose parts that are kept apart")
    run = RunDirectory(folder)
    names = (*route.gathers, *OWN_STAGES)
    stages = Stages(run, SEED, torch.device("cpu"), names)
    if not (folder / "config.json").is_file():
        folder.mkdir(parents=True, exist_ok=True)
        config = {
            "format": 1, "luminaire": str(subject.scene.resolve()), "digest": "0" * 64,
            "route": route.__name__, "anchor": "none", "seed": SEED, "preset": preset.to_dict(),
        }  # fmt: skip
        run.write_json("config.json", config)
    torch.set_num_threads(subject.threads)
    lamp = ProxyLamp(subject.scene, preset.paths, stages)
    lamp.around = around
    return ProxyTraining(route(lamp, preset, stages))


def finish(
    training: Training, declared: Sequence[Trained[Any]], file: Path, account: Account
) -> None:
    """Train what is not trained yet and export it to a file, each on its account."""
    from purelight_export.export import export

    for network in declared:
        with account.stage(network.name):
            train(training, [network])
    with account.stage("export"):
        names = [network.name for network in declared if network is not STUDENT]
        export(training.stages.run.path, file, networks=names)


def train(training: Training, declared: Sequence[Trained[Any]]) -> RunDirectory:
    """Train what is not trained yet, and write what an exporter asks for."""
    training.lamp.store()
    for network in declared:
        if network is not TRANSPARENCY or training.has(network):
            training.network(network)
    run = training.stages.run
    run.write_json("metrics.json", training.stages.metrics())
    return run
