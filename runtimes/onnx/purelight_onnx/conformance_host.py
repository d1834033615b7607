"""This runtime as a host of the conformance suite: `python -m purelight_onnx.conformance_host`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import numpy as np

from purelight_conformance import protocol
from purelight_format import measures, reflection
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere, Placement
from purelight_format.members import finishes
from purelight_format.members.manifest_reader import Reader
from purelight_format.networks.kinds import KINDS
from purelight_onnx import lighting
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.viewer import shade

Arrays = dict[str, np.ndarray]
Parameters = Mapping[str, Any]


class OnnxHost:
    """Answers with `Luminaire`, `lighting` and the viewer; geometry in float32."""

    name = "purelight-onnx"
    version = metadata.version("purelight")
    operations: tuple[str, ...] = (
        *KINDS, "frame", "square_to_disk", "disk_to_square", "cap", "cap_to_direction",
        "direction_to_cap", "area_to_solid_angle", "finish", "instance_radiance",
        "instance_sample", "view", "estimate", "map_estimate", protocol.READER,
    )  # fmt: skip

    def __init__(self) -> None:
        self._lamp: Luminaire | None = None

    def open(self, path: str) -> None:
        self._lamp = None
        lamp = Luminaire.open(path)
        for network in filter(lamp.has, KINDS):
            lamp.network(network)  # Loaded now, so that its golden vectors are compared.
        self._lamp = lamp

    def evaluate(self, operation: str, parameters: Parameters, inputs: Arrays) -> Arrays:
        if operation in KINDS:
            return self.lamp.evaluate(operation, **inputs)
        answer: Arrays = getattr(self, f"_{operation}")(parameters, **inputs)
        return answer

    @property
    def lamp(self) -> Luminaire:
        if self._lamp is None:
            raise PureLightError("open a bundle first")
        return self._lamp

    # Geometry

    def _frame(self, _: Parameters, axis: np.ndarray) -> Arrays:
        tangent, bitangent = measures.frame(axis)
        return {"tangent": tangent, "bitangent": bitangent}

    def _square_to_disk(self, _: Parameters, u: np.ndarray) -> Arrays:
        return {"disk": measures.square_to_disk(u)}

    def _disk_to_square(self, _: Parameters, disk: np.ndarray) -> Arrays:
        return {"u": measures.disk_to_square(disk)}

    def _cap(self, given: Parameters, point: np.ndarray) -> Arrays:
        cap = measures.cap(point, _sphere(given))
        outside = cap.outside.astype(np.float32)
        return {"axis": cap.axis, "one_minus_cos": cap.one_minus_cos, "outside": outside}

    def _cap_to_direction(self, given: Parameters, point: np.ndarray, u: np.ndarray) -> Arrays:
        cap = measures.cap(point, _sphere(given))
        pdf = np.where(cap.outside, 1 / cap.solid_angle, 0)
        return {"toward": measures.cap_to_direction(u, cap), "pdf_solid_angle": pdf}

    def _direction_to_cap(self, given: Parameters, point: np.ndarray, toward: np.ndarray) -> Arrays:
        square, inside = measures.direction_to_cap(toward, measures.cap(point, _sphere(given)))
        return {"u": square, "inside": inside.astype(np.float32)}

    def _area_to_solid_angle(self, _: Parameters, **met: np.ndarray) -> Arrays:
        return {"pdf_solid_angle": measures.area_to_solid_angle(**met)}

    def _finish(self, given: Parameters, **met: np.ndarray) -> Arrays:
        finish = finishes.read(Reader(given["finish"], "finish"))
        return vars(reflection.answer(finish, **met))

    # The lamp in the world

    def _instance_radiance(
        self, given: Parameters, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
    ) -> Arrays:
        place = _placement(given)
        side = np.where((normal * outgoing).sum(1) < 0, -1, 1)[:, None]
        normal, outgoing = map(place.direction_to_local, (normal * side, outgoing))
        radiance = self.lamp.radiance(place.point_to_local(position), normal, outgoing)
        return {"radiance": _dimmer(given) * radiance}

    def _instance_sample(self, given: Parameters, point: np.ndarray, u: np.ndarray) -> Arrays:
        place = _placement(given)
        toward, pdf = self.lamp.sample(place.point_to_local(point), u)
        return {"toward": place.direction_to_world(toward), "pdf_solid_angle": pdf}

    def _view(self, given: Parameters, origin: np.ndarray, direction: np.ndarray) -> Arrays:
        """The viewer with the lamp at full level, before a background that makes up for it."""
        place = _placement(given)
        start, toward = place.point_to_local(origin), place.direction_to_local(direction)
        behind = np.array(given["background"])
        alone = shade(self.lamp, start, toward, np.zeros(3))
        return {"radiance": shade(self.lamp, start, toward, behind) + (_dimmer(given) - 1) * alone}

    def _estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        local = _brought(given, point, normal)
        return {"irradiance": _dimmer(given) * lighting.by_sampler(self.lamp, *local, u)}

    def _map_estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        local = _brought(given, point, normal)
        return {"irradiance": _dimmer(given) * lighting.by_map(self.lamp, *local, u)}


def _placement(given: Parameters) -> Placement:
    return Placement.of(given.get("to_world", np.eye(4)), "the lamp")


def _dimmer(given: Parameters) -> float:
    dimmer = float(given.get("dimmer", 1.0))
    if not 0 <= dimmer < np.inf:
        raise PureLightError(f"dimmer must be at least 0 and finite, not {dimmer:g}")
    return dimmer


def _brought(
    given: Parameters, point: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of the world in the luminaire frame."""
    place = _placement(given)
    return place.point_to_local(point), place.direction_to_local(normal)


def _sphere(given: Parameters) -> BoundingSphere:
    sphere = given["bounding_sphere"]
    x, y, z = sphere["center"]
    return BoundingSphere((x, y, z), sphere["radius"])


if __name__ == "__main__":
    sys.exit(protocol.serve(OnnxHost()))
