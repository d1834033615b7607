"""This runtime as a host of the conformance suite: `python -m purelight_onnx.conformance_host`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import numpy as np

from purelight_conformance import protocol
from purelight_format import measures
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.networks.kinds import KINDS
from purelight_onnx.exit_surface import ExitSurface
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.viewer import shade

Arrays = dict[str, np.ndarray]
Parameters = Mapping[str, Any]
TOLERANCE = 1e-4


class Placement:
    """World to luminaire frame and back: world = scale · rotation · local + translation.

    Arguments:
        parameters: of the call: `to_world`, 16 numbers row by row, and `dimmer`.

    Raises:
        PureLightError: If the transform is more than a rotation, a uniform scale and a shift.
    """

    def __init__(self, parameters: Parameters) -> None:
        matrix = np.reshape(parameters.get("to_world", np.eye(4)), (4, 4)).astype(np.float64)
        self.dimmer = float(parameters.get("dimmer", 1.0))
        self.scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        if self.scale <= 0:
            raise PureLightError("to_world mirrors or flattens the lamp")
        self.rotation, self.shift = matrix[:3, :3] / self.scale, matrix[:3, 3]
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=TOLERANCE):
            raise PureLightError("to_world shears the lamp or scales its axes differently")

    def point(self, world: np.ndarray) -> np.ndarray:
        return (world - self.shift) @ self.rotation / self.scale

    def direction(self, world: np.ndarray) -> np.ndarray:
        return world @ self.rotation

    def outward(self, local: np.ndarray) -> np.ndarray:
        return local @ self.rotation.T


class OnnxHost:
    """Answers with `Luminaire`, `ExitSurface` and the viewer; geometry in float32."""

    name = "purelight-onnx"
    version = metadata.version("purelight")
    operations: tuple[str, ...] = (
        *KINDS, "frame", "square_to_disk", "disk_to_square", "cap", "cap_to_direction",
        "direction_to_cap", "area_to_solid_angle", "instance_radiance", "instance_sample", "view",
        "estimate", "map_estimate", protocol.READER,
    )  # fmt: skip

    def __init__(self) -> None:
        self._lamp: Luminaire | None = None
        self._surface: ExitSurface | None = None

    def open(self, path: str) -> None:
        self._lamp = self._surface = None
        lamp = Luminaire.open(path)
        for network in filter(lamp.has, KINDS):
            lamp.network(network)  # Loaded now, so that its golden vectors are compared.
        self._lamp = lamp
        self._surface = ExitSurface(lamp.bundle.surface(), lamp.manifest.bounding_sphere)

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

    @property
    def surface(self) -> ExitSurface:
        if self._surface is None:
            raise PureLightError("open a bundle first")
        return self._surface

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

    def _area_to_solid_angle(
        self,
        _: Parameters,
        point: np.ndarray,
        position: np.ndarray,
        normal: np.ndarray,
        pdf_area: np.ndarray,
    ) -> Arrays:
        offset = position - point
        distance = np.linalg.norm(offset, axis=1)
        cosine = np.abs((offset * normal).sum(1)) / distance
        return {"pdf_solid_angle": pdf_area * distance**2 / cosine}

    # The lamp in the world

    def _instance_radiance(
        self, given: Parameters, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
    ) -> Arrays:
        place = Placement(given)
        side = np.where((normal * outgoing).sum(1) < 0, -1, 1)[:, None]
        radiance = self.lamp.radiance(
            place.point(position), place.direction(normal * side), place.direction(outgoing)
        )
        return {"radiance": place.dimmer * radiance}

    def _instance_sample(self, given: Parameters, point: np.ndarray, u: np.ndarray) -> Arrays:
        place = Placement(given)
        toward, pdf = self.lamp.sample(place.point(point), u)
        return {"toward": place.outward(toward), "pdf_solid_angle": pdf}

    def _view(self, given: Parameters, origin: np.ndarray, direction: np.ndarray) -> Arrays:
        """The viewer with the lamp at full level, before a background that makes up for it."""
        place = Placement(given)
        start, toward = place.point(origin), place.direction(direction)
        behind = np.array(given["background"])
        alone = shade(self.lamp, self.surface, start, toward, np.zeros(3))
        return {
            "radiance": shade(self.lamp, self.surface, start, toward, behind)
            + (place.dimmer - 1) * alone
        }

    def _estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        place = Placement(given)
        start = place.point(point)
        toward, pdf = self.lamp.sample(start, u)
        hits = self.surface.intersect(start, toward.astype(np.float64))
        radiance = self.lamp.radiance(hits.position, hits.normal, -toward[hits.ray])
        cosine = np.maximum((toward * place.direction(normal)).sum(1), 0)
        weight = np.divide(cosine, pdf, out=np.zeros_like(cosine), where=pdf > 0)
        irradiance = np.zeros((len(point), 3))
        irradiance[hits.ray] = place.dimmer * radiance * weight[hits.ray, None]
        return {"irradiance": irradiance}

    def _map_estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        place, rows = Placement(given), np.arange(len(point))
        start = place.point(point)
        cells = self.lamp.radiance_map(start).reshape(-1, 256, 3).astype(np.float64)
        power = cells @ LUMINANCE
        reached = np.cumsum(power, 1)
        target = u[:, 0] * reached[:, -1]
        chosen = np.minimum((reached <= target[:, None]).sum(1), 255)
        own, total = power[rows, chosen], reached[:, -1]
        lit = own > 0
        rest = np.divide(
            target - reached[rows, chosen] + own, own, out=np.zeros_like(own), where=lit
        )
        corner = np.stack((chosen % 16, chosen // 16), 1)
        square = (corner + np.stack((rest, u[:, 1]), 1)) / 16
        cap = measures.cap(start, self.lamp.manifest.bounding_sphere)
        share = np.divide(total * cap.solid_angle, own * 256, out=np.zeros_like(own), where=lit)
        share *= cap.outside
        weight = place.dimmer * cells[rows, chosen] * share[:, None]
        toward = measures.cap_to_direction(square, cap)
        cosine = np.maximum((toward * place.direction(normal)).sum(1), 0)
        return {"irradiance": weight * cosine[:, None]}


def _sphere(given: Parameters) -> BoundingSphere:
    sphere = given["bounding_sphere"]
    x, y, z = sphere["center"]
    return BoundingSphere((x, y, z), sphere["radius"])


if __name__ == "__main__":
    sys.exit(protocol.serve(OnnxHost()))
