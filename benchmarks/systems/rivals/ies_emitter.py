"""The emitter plugin of `ies`. Import it once a variant of Mitsuba is set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.measures import Placement
from purelight_mitsuba.lamps.frame import Frame
from purelight_mitsuba.sampling.direction_table import DirectionTable
from purelight_mitsuba.sampling.far_field import FarField


class IesEmitter(mi.Emitter):
    """A point whose intensity is that of an IES file, scaled to a flux of three channels.

    Properties: `filename`, `flux` in W, `centre` in the frame of the file, `to_world`.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        path = Path(str(mi.file_resolver().resolve(str(props["filename"]))))
        flux, centre = (np.array(_three(props, name)) for name in ("flux", "centre"))
        field = FarField.of(path.read_bytes(), path.name)
        self._intensity = DirectionTable(field.values[..., None] * flux)
        matrix = np.array(props["to_world"].matrix if "to_world" in props else np.eye(4))
        place = Placement.of(matrix, path.name)
        at = place.point_to_world(centre[None])[0].tolist()
        self._at, self._where = mi.Point3f(at), mi.ScalarPoint3f(*at)
        x, y, z = (mi.Vector3f(*row) for row in place.rotation.tolist())
        self._frame = Frame(x, y, z, mi.Point3f(0), mi.Float(1))
        self._factor = mi.Float(place.scale**2)
        dr.make_opaque(self._frame, self._at, self._factor)
        self.m_flags = mi.EmitterFlags.DeltaPosition

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Spectrum]:
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = mi.Point3f(self._at)
        ds.d = ds.p - it.p
        square = dr.squared_norm(ds.d)
        ds.dist = dr.sqrt(square)
        ds.d /= ds.dist
        ds.time = it.time
        ds.pdf = dr.select(active & (square > 0), mi.Float(1), 0)
        ds.delta = mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        toward = -self._frame.direction_to_local(ds.d)
        intensity = self._intensity.at(toward, active) * self._factor
        return ds, dr.select(ds.pdf > 0, intensity / square, 0)

    def bbox(self) -> mi.ScalarBoundingBox3f:
        return mi.ScalarBoundingBox3f(self._where, self._where)

    # A point is not met by any ray, and Mitsuba asks all emitters that a process has seen.

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    def eval(self, si: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    def to_string(self) -> str:
        return "IesEmitter[]"


def _three(props: mi.Properties, name: str) -> list[float]:
    value = props[name]
    if isinstance(value, mi.Object):  # a texture of one colour
        value = mi.traverse(value)["value"]
    return [float(v) for v in np.ravel(np.array(value))]
