"""The training run: one route to the student, then the networks that are made from it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.ray_file.files import is_ray_file
from purelight_train.learning.teacher import Teacher
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.measured_luminaire import MeasuredLuminaire, ray_digest
from purelight_train.light.scene_files import scene_digest
from purelight_train.light.virtual_surface import AUTO, START, TIGHT
from purelight_train.networks.student import Student
from purelight_train.presets import Preset
from purelight_train.runs.anchor_choice import choose_anchor
from purelight_train.runs.evaluation import as_function, fidelity, write_previews
from purelight_train.runs.judging import judge, verdict
from purelight_train.runs.routes import ROUTES, TeacherRoute
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import Stages
from purelight_train.runs.traced_lamp import TracedLamp
from purelight_train.runs.trained import STUDENT, TRAINED, TRANSPARENCY
from purelight_train.runs.trainer import Trainer
from purelight_train.truth.counting import counting_errors
from purelight_train.verdict.measure import Judge

Float = NDArray[np.float32]


class Training(Trainer):
    """One training run of one luminaire into one run directory."""

    @property
    def student(self) -> Student:
        return self.network(STUDENT)

    @property
    def teacher(self) -> Teacher | None:
        """The teacher, on the route that has one."""
        return self.route.teacher if isinstance(self.route, TeacherRoute) else None

    @cached_property
    def judge(self) -> Judge:
        """Who measures what was trained."""
        return judge(self)

    def __call__(self, *, judged: bool = True) -> dict[str, Any]:
        """Run every unfinished stage and write metrics and previews.

        Arguments:
            judged: measure the verdict, with light traced for it.

        Returns:
            the contents of metrics.json.
        """
        self.lamp.store()
        for declared in filter(self.has, TRAINED):
            self.network(declared)
        known = not isinstance(self.lamp.luminaire, MeasuredLuminaire)  # and can be traced afresh
        told = {"verdict": verdict(self, self.judge).to_json()} if judged and known else {}
        metrics = self._metrics() | told
        device, see_through = self.stages.device, self.has(TRANSPARENCY)
        write_previews(
            self.stages.run,
            self.lamp.surface,
            as_function(self.student, device),
            as_function(self.network(TRANSPARENCY), device) if see_through else opaque,
            self.route.teacher_radiance,
        )
        self.stages.run.write_json("metrics.json", metrics)
        return metrics

    def _metrics(self) -> dict[str, Any]:
        """Contents of metrics.json: flux, fidelity, and each stage's time and losses."""
        radiance = as_function(self.student, self.stages.device)
        return {
            "flux": list(self.lamp.description.flux),
            "flux_error": list(self.lamp.description.flux_error),
            "dropped": self.lamp.description.dropped,
            "flux_gain": self.student.gain.tolist(),
            **fidelity(radiance, self.lamp, self.stages.rng("metrics")),
            **self._measured(),
            **self.stages.metrics(),
        }

    def _measured(self) -> dict[str, Any]:
        """What a lamp of measured rays is known by, and how well."""
        luminaire = self.lamp.luminaire
        if not isinstance(luminaire, MeasuredLuminaire):
            return {}
        errors = counting_errors(luminaire.records, self.lamp.surface.sphere)
        return {"measured": luminaire.facts() | errors}


def opaque(position: Float, normal: Float, outgoing: Float) -> Float:
    """Transmittance of a lamp that no light passes: [N, 3] of zeros."""
    return np.zeros_like(position)


def start(
    scene: Path,
    output: Path,
    preset: Preset,
    seed: int,
    device: str,
    *,
    resume: bool,
    route: str = "teacher",
    anchor: str = "none",
    early_stop: bool = False,
    exit_surface: str = AUTO,
    judged: bool = True,
    look: Callable[[Luminaire | MeasuredLuminaire], None] = lambda _: None,
) -> Training:
    """Prepare a run directory for a luminaire, or continue one.

    Arguments:
        preset: of no route yet.
        route: one of `routes.ROUTES`.
        anchor: which anchors of a ray the student encodes, one of `presets.ANCHORS`, or `auto` to
            try them out on the lamp (`anchor_choice`).
        early_stop: end optimisations whose error on held-out light has stopped falling; always
            where measured rays are too few for all steps.
        exit_surface: where measured rays leave the lamp (`measured_luminaire.load_measured`).
        judged: whether the run is to end with a verdict.
        look: called with the lamp of a new run before its light is traced.

    Raises:
        PureLightError: the directory holds another run, or a run and `resume` is not set.
    """
    run = RunDirectory(output)
    measured = is_ray_file(scene)
    if exit_surface != AUTO and not measured:
        raise PureLightError(f"{scene}: a scene has its own exit surface; leave --exit-surface out")
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; give a Mitsuba 3 scene (.xml) of a lamp")
    config: dict[str, Any] = {
        "format": 1,
        "luminaire": str(scene.resolve()),
        "digest": _digest(scene),
        "route": route,
        "anchor": anchor,
        "seed": seed,
        **(_surface_of(exit_surface) if measured else {}),
    }
    exit_surface = config.get("exit_surface", AUTO)
    left_out = ("verdict", *TRANSPARENCY.stages) if measured else ("verdict",) if not judged else ()
    stages = Stages(run, seed, torch.device(device), stage_names(route, left_out), early_stop)
    if (output / "config.json").is_file():
        return _continue(scene, stages, config, preset, resume=resume)
    lamp = TracedLamp(scene, preset.for_route(route).paths, stages, exit_surface, preset.tolerance)
    look(lamp.luminaire)
    lamp.description  # noqa: B018 - a faulty or dark lamp must leave nothing behind
    if anchor == "auto":
        anchor, tried = choose_anchor(lamp, preset)
        config["tried_anchors"] = tried
    chosen = preset.for_route(route, anchor=anchor)
    _spare(lamp, chosen)
    output.mkdir(parents=True, exist_ok=True)
    run.write_json("config.json", config | {"preset": chosen.to_dict()})
    return Training(ROUTES[route](lamp, chosen, stages))


def _digest(scene: Path) -> str:
    """Of a lamp's scene, or of measured rays."""
    return ray_digest(scene) if is_ray_file(scene) else scene_digest(scene)


def _surface_of(choice: str) -> dict[str, str]:
    """What a configuration says of the exit surface of measured rays, a mesh file's digest too."""
    if choice in (AUTO, START, TIGHT):
        return {"exit_surface": choice}
    mesh = Path(choice).resolve()  # A run is used from other folders too.
    if not mesh.is_file():
        raise PureLightError(f"{choice}: no such file; give a mesh in metres (.ply, .obj, .stl)")
    return {"exit_surface": str(mesh), "surface_digest": ray_digest(mesh)}


def _continue(
    scene: Path, stages: Stages, config: dict[str, Any], preset: Preset, *, resume: bool
) -> Training:
    """Go on with a run that was begun in the same way."""
    run, route = stages.run, config["route"]
    if not resume:
        raise PureLightError(f"{run.path}: holds a run already; add --resume or choose another")
    old = run.config
    anchor = run.preset.anchor if config["anchor"] == "auto" else config["anchor"]
    chosen = preset.for_route(route, anchor=anchor)
    asked = config | {"preset": chosen.to_dict()}
    keys = ("digest", "seed", "route", "anchor", "preset", "exit_surface", "surface_digest")
    changed = [key for key in keys if old.get(key) != asked.get(key)]
    if changed:
        raise PureLightError(
            f"{run.path}: was made with another {changed[0]}; choose another --output"
        )
    lamp = TracedLamp(
        scene, chosen.paths, stages, config.get("exit_surface", AUTO), chosen.tolerance
    )
    _spare(lamp, chosen)
    return Training(ROUTES[route](lamp, chosen, stages))


def _spare(lamp: TracedLamp, preset: Preset) -> None:
    """Let optimisations stop early where the light that there is would be learned by heart."""
    if is_ray_file(lamp.scene) and isinstance(lamp.luminaire, MeasuredLuminaire):
        draws = preset.photons.steps * preset.photons.batch
        lamp.stages.early_stop |= lamp.luminaire.is_scarce(draws)


def reopen(run: RunDirectory, scene: Path, device: str = "cpu") -> Training:
    """A run as it was started, to look at what it made or to use it further.

    Raises:
        PureLightError: the lamp is not there any more, or is another by now.
    """
    config, preset = run.config, run.preset
    _require_unchanged(run, scene, config)
    stages = Stages(run, config["seed"], torch.device(device), stage_names(config["route"]))
    route = ROUTES[config["route"]]
    lamp = TracedLamp(
        scene, preset.paths, stages, config.get("exit_surface", AUTO), preset.tolerance
    )
    return Training(route(lamp, preset, stages))


def _require_unchanged(run: RunDirectory, scene: Path, config: dict[str, Any]) -> None:
    """Refuse a lamp that is not what a run was trained of: networks would not fit it."""
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; {run.path} was trained of it")
    surface = config.get("exit_surface", AUTO)
    same = _digest(scene) == config["digest"]
    if same and "surface_digest" in config:
        scene, same = Path(surface), config == config | _surface_of(surface)
    if not same:
        raise PureLightError(f"{scene}: is not what {run.path} was trained of; train it again")


def stage_names(route: str, left_out: Collection[str] = ()) -> tuple[str, ...]:
    """The stages of a run, in order, but those left out."""
    names = (*ROUTES[route].gathers, *(name for d in TRAINED for name in d.stages), "verdict")
    return tuple(name for name in names if name not in left_out)
