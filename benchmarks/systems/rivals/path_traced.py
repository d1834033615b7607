"""What a path tracer sees of a lamp from rays around it: the targets of `ncl`."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import torch

from purelight_train.learning.flux_closure import LIFT
from purelight_train.learning.training_sets import SurfaceSet, viewed_rays
from purelight_train.networks.student import MAX_LOG, Student
from purelight_train.presets import Optimisation
from purelight_train.runs.routes import Route
from purelight_train.runs.stages import Loss, rows

SHARE = 8  # of the rays that our students are distilled from, one in so many
SAMPLES = 256  # paths for each
BATCH = 1 << 20


class PathTracedRoute(Route):
    """The student regresses, in log1p, what Mitsuba's `path` finds along rays into the sphere.

    The flux is what comes of it: no light is traced to correct it, as none is in the paper.
    """

    gathers = ("light", "targets")

    @property
    def optimisation(self) -> Optimisation:
        return self.preset.student

    def loss(self, student: Student) -> Loss:
        arrays = self.targets()
        data = self.stages.tensors(*arrays)
        brightest = torch.from_numpy(arrays[-1].max(0)) / student.scale
        student.ceiling.copy_(torch.log1p(brightest).clamp(max=MAX_LOG))
        return lambda step: student.loss(*rows(data, step, self.optimisation.batch))

    def targets(self) -> SurfaceSet:
        """Rays and their radiance, from the run directory if they are there."""
        run = self.stages.run
        if not (run.path / "targets.npz").is_file():
            run.write_arrays("targets.npz", rays=np.stack(self._traced()))
        position, normal, outgoing, radiance = run.read_arrays("targets.npz")["rays"]
        return position, normal, outgoing, radiance

    def _traced(self) -> SurfaceSet:
        rng, lamp = self.stages.rng("targets"), self.lamp.modelled
        count = self.preset.distillation_samples // SHARE
        position, normal, outgoing = viewed_rays(lamp.exit_surface, count, rng, cosine=True)
        start = position + LIFT * lamp.exit_surface.sphere.radius * outgoing
        radiance, step = np.zeros_like(position), max(BATCH // SAMPLES, 1)
        with self.stages.bar("targets", len(position), "ray") as update:
            for i in range(0, len(position), step):
                part = slice(i, i + step)
                radiance[part] = path_traced(lamp.scene, start[part], -outgoing[part], i)
                update(min(i + step, len(position)))
        return position, normal, outgoing, radiance

    def close(self, student: Student) -> None:
        """Nothing is known of the flux."""


def path_traced(
    scene: mi.Scene, origin: np.ndarray, direction: np.ndarray, seed: int, samples: int = SAMPLES
) -> np.ndarray:
    """Mean radiance along rays by `path` with next event estimation: two of [N, 3] -> [N, 3]."""
    integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 8})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed & 0xFFFFFFFF, len(origin) * samples)
    o, d = (np.repeat(a, samples, 0).T.astype(np.float32) for a in (origin, direction))
    ray = mi.RayDifferential3f(mi.Point3f(o), mi.Vector3f(d))
    value = np.array(integrator.sample(scene, sampler, ray)[0], np.float64).T
    value = np.where(np.isfinite(value).all(1, keepdims=True), value, 0)
    mean: np.ndarray = value.reshape(-1, samples, 3).mean(1).astype(np.float32)
    return mean
