"""Radiance at many points at once, by Dr.Jit or by ONNX Runtime."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.transport.light import Light
from purelight_mitsuba.transport.queries import ExitRay, finite
from purelight_mitsuba.transport.walk import Question

# Multiply-adds a sample. ONNX Runtime multiplies matrices three times as fast, but looks grids up
# five times as slowly: measured, 0.5 + 0.042 and 2.3 + 0.016 microseconds per thousand.
LARGEST_COMPILED = 68_000


class Answers:
    """Evaluates the appearance networks on questions that wait, without an idle lane.

    Arguments:
        luminaires: The bundles that questions count as assets.
    """

    def __init__(self, luminaires: Sequence[Luminaire]) -> None:
        self._luminaires = luminaires
        self._compiled = [compiled(luminaire) for luminaire in luminaires]

    def add(self, light: Light, question: Question, lane: mi.UInt32) -> None:
        """Adds weighted radiance to the light of lanes, in place."""
        for index, luminaire in enumerate(self._luminaires):
            chosen = dr.compress(question.asked & (question.asset == index))
            if len(chosen) == 0:
                continue
            own = dr.gather(Question, question, chosen)
            evaluate = _compiled if self._compiled[index] else _batched
            radiance = finite(evaluate(luminaire, own.ray))
            found = Light.dark(len(light.groups)).add(radiance.value * own.weight, own.group)
            light.scatter(found.spoil(radiance.spoilt), dr.gather(mi.UInt32, lane, chosen))
            dr.eval(light)


def compiled(luminaire: Luminaire) -> bool:
    """Whether Dr.Jit evaluates a luminaire's appearance sooner than ONNX Runtime."""
    if dr.backend_v(mi.Float) == dr.JitBackend.CUDA:
        return True
    return luminaire.cost("appearance") <= LARGEST_COMPILED


def _compiled(luminaire: Luminaire, ray: ExitRay) -> mi.Color3f:
    return ray.ask(luminaire, "appearance")


def _batched(luminaire: Luminaire, ray: ExitRay) -> mi.Color3f:
    rows = {part.name: np.array(getattr(ray, part.name)).T for part in fields(ray)}
    radiance = luminaire.session("appearance")(rows)["radiance"]
    return mi.Color3f(np.ascontiguousarray(radiance.T))
