"""The emitter plugin `purelight`: a lamp from a bundle at a place in the scene."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere, Placement
from purelight_format.members.finishes import Finish
from purelight_mitsuba.lamps.luminaire import Luminaire, load


class BundleEmitter(mi.Emitter):
    """A bundle at a place in the scene, without light of its own.

    Properties: `filename` (the bundle; a relative path is looked up beside the scene file),
    `to_world` (rotation, uniform scale and translation), `dimmer` (factor on the radiance,
    default 1), `light_group` (default the lamp's id, without one the bundle's name),
    `finishes` (default true: the lamp answers other light, if its bundle says how),
    `check_vectors` (default true: networks are compared with the bundle's golden
    vectors before their first use; the last lamp of a bundle decides for all of that bundle).
    `mi.traverse` exposes `to_world` and `dimmer`. A bundle that was written anew is read again
    before the next rendering.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        if "filename" not in props:
            raise PureLightError("a lamp needs a filename, that of its bundle")
        name = str(props["filename"])
        path = Path(str(mi.file_resolver().resolve(name)))
        if not path.is_file():
            raise PureLightError(f"{name}: no such file; filename must lead to a .plux bundle")
        self.path = path
        self.luminaire: Luminaire = load(path)
        self.luminaire.check_vectors = bool(props.get("check_vectors", True))
        name = self.id()
        usual = path.stem if name.startswith("_") or not name else name
        self.light_group = str(props.get("light_group", usual))
        level = float(np.float32(props.get("dimmer", 1.0)))
        self._answers = bool(props.get("finishes", True))
        matrix = np.eye(4)
        if "to_world" in props:
            matrix = np.array(props["to_world"].matrix, np.float32)
        self.to_world, self.dimmer = mi.Transform4f(matrix), mi.Float(level)
        self.m_flags = mi.EmitterFlags.Empty
        # Whoever waits for Dr.Jit while a scene is loaded is given the next lamp to load: not here,
        # or a scene of hundreds would nest them beyond Python's limit.
        self._place(matrix, level)

    def _place(self, matrix: np.ndarray, level: float) -> None:
        name = self.luminaire.path.name
        placement = Placement.of(np.asarray(matrix, np.float64), name)
        if not (math.isfinite(level) and level >= 0):
            raise PureLightError(f"{name}: dimmer must be a finite number of zero or more")
        self.placement, self.level = placement, level  # What is refused changes nothing

    @property
    def finishes(self) -> tuple[Finish, ...]:
        """Of what the lamp is made, if it is to answer other light."""
        return self.luminaire.finishes if self._answers else ()

    def sphere(self) -> BoundingSphere:
        """The bounding sphere in the world."""
        own, place = self.luminaire.sphere, self.placement
        x, y, z = place.point_to_world(np.array([own.center]))[0].tolist()
        return BoundingSphere((x, y, z), place.scale * own.radius)

    def refresh(self) -> None:
        """Reads the bundle again if it changed; a file that is gone leaves the lamp as it is.

        Raises:
            PureLightError: If it is no valid bundle any more.
        """
        if self.path.is_file():
            check = self.luminaire.check_vectors
            self.luminaire = load(self.path)
            self.luminaire.check_vectors = check

    def traverse(self, callback: Any) -> None:
        callback.put("dimmer", self.dimmer, mi.ParamFlags.NonDifferentiable)
        callback.put("to_world", self.to_world, mi.ParamFlags.NonDifferentiable)

    def parameters_changed(self, keys: list[str]) -> None:
        self._place(np.array(self.to_world.matrix).reshape(4, 4), float(self.dimmer.numpy()[0]))

    def bbox(self) -> mi.ScalarBoundingBox3f:
        sphere = self.sphere()
        centre, radius = np.array(sphere.center), sphere.radius
        return mi.ScalarBoundingBox3f(
            mi.ScalarPoint3f(centre - radius), mi.ScalarPoint3f(centre + radius)
        )

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Spectrum]:
        return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    def eval(self, si: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    # Light tracers call every emitter plugin that a process has seen, scene or not.

    def sample_ray(
        self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Spectrum]:
        return dr.zeros(mi.Ray3f), mi.Spectrum(0)

    def sample_position(
        self, time: Any, sample: Any, active: Any = True
    ) -> tuple[mi.PositionSample3f, mi.Float]:
        return dr.zeros(mi.PositionSample3f), mi.Float(0)

    def pdf_position(self, ps: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def sample_wavelengths(
        self, si: Any, sample: Any, active: Any = True
    ) -> tuple[Any, mi.Spectrum]:
        return dr.zeros(mi.Color0f), mi.Spectrum(0)

    def to_string(self) -> str:
        return f"PureLight[{self.luminaire.path.name}]"


class PureLightEmitter(BundleEmitter):
    """A lamp that only the integrator `purelight` can see; others render it dark and invisible."""
