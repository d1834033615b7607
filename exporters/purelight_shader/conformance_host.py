"""The C++ runtime as a host of the conformance suite.

    python -m purelight_shader.conformance_host

Each bundle that is opened becomes C++, is compiled by the system's compiler and loaded; every
number of an answer comes from `purelight.h` and the generated code. Rays meet the exit surface in
Embree, as renderers have their own.
"""

from __future__ import annotations

import ctypes
import math
import sys
import tempfile
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from purelight_conformance import protocol
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.measures import Placement, light_estimate
from purelight_format.networks.kinds import KINDS
from purelight_onnx.exit_surface import ExitSurface
from purelight_shader.library import Library, build, measures, pointer
from purelight_shader.targets.cpp import METHODS
from purelight_shader.translation import function

Arrays = dict[str, np.ndarray]
Parameters = Mapping[str, Any]
FLAGS = ("-O1",)  # Many small lamps are compiled, and each asked little.
Shapes = Mapping[str, tuple[int, ...]]
NETWORKS: dict[str, tuple[str, Shapes]] = {
    network: (function(network), {k: output.shape for k, output in kind.outputs.items()})
    for network, kind in KINDS.items()
    if network in METHODS
}
MEASURES: dict[str, Shapes] = {
    "frame": {"tangent": (3,), "bitangent": (3,)},
    "square_to_disk": {"disk": (2,)},
    "disk_to_square": {"u": (2,)},
    "cap": {"axis": (3,), "one_minus_cos": (), "outside": ()},
    "cap_to_direction": {"toward": (3,), "pdf_solid_angle": ()},
    "direction_to_cap": {"u": (2,), "inside": ()},
    "area_to_solid_angle": {"pdf_solid_angle": ()},
}
ORDER = {
    "frame": ("axis",),
    "square_to_disk": ("u",),
    "disk_to_square": ("disk",),
    "cap": ("point",),
    "cap_to_direction": ("point", "u"),
    "direction_to_cap": ("point", "toward"),
    "area_to_solid_angle": ("point", "position", "normal", "pdf_area"),
}


class CppHost:
    """Answers with compiled lamps.

    Arguments:
        folder: for what is compiled.
    """

    name = "purelight-cpp"
    version = metadata.version("purelight")
    operations: tuple[str, ...] = (
        *NETWORKS, *MEASURES, "instance_radiance", "instance_sample", "view", "estimate",
        "map_estimate",
    )  # fmt: skip

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._measures: Library | None = None
        self._built: dict[str, tuple[Library, ExitSurface]] = {}
        self._open: tuple[Library, ExitSurface] | None = None

    def open(self, path: str) -> None:
        self._open = None
        bundle = Bundle.open(path)
        if bundle.digest not in self._built:
            library = build(bundle, self._folder / bundle.digest[:16], FLAGS)
            surface = ExitSurface(bundle.surface(), bundle.manifest.bounding_sphere)
            self._built[bundle.digest] = library, surface
        self._open = self._built[bundle.digest]

    def evaluate(self, operation: str, parameters: Parameters, inputs: Arrays) -> Arrays:
        if operation in NETWORKS:
            function, outputs = NETWORKS[operation]
            return self._ask(function, inputs, outputs)
        if operation in MEASURES:
            return self._measured(operation, parameters, inputs)
        answer: Arrays = getattr(self, f"_{operation}")(parameters, **inputs)
        return answer

    def _lamp(self) -> tuple[Library, ExitSurface]:
        if self._open is None:
            raise PureLightError("open a bundle first")
        return self._open

    def _ask(self, function: str, inputs: Arrays, outputs: Shapes, *leading: Any) -> Arrays:
        sizes = [math.prod(shape) for shape in outputs.values()]
        results = self._lamp()[0].ask(function, list(inputs.values()), sizes, *leading)
        return _shaped(outputs, results)

    def _measured(self, operation: str, parameters: Parameters, inputs: Arrays) -> Arrays:
        if self._measures is None:
            self._measures = measures(self._folder)
        leading: tuple[Any, ...] = ()
        if "bounding_sphere" in parameters:
            given = parameters["bounding_sphere"]
            sphere = np.array([*given["center"], given["radius"]], np.float32)
            leading = (pointer(sphere),)
        outputs = MEASURES[operation]
        sizes = [math.prod(shape) for shape in outputs.values()]
        ordered = [inputs[name] for name in ORDER[operation]]
        return _shaped(outputs, self._measures.measure(operation, ordered, sizes, *leading))

    # The lamp in the world

    def _instance_radiance(self, given: Parameters, **met: np.ndarray) -> Arrays:
        place = _to_world(given)
        return self._ask(
            "instance_radiance", met, {"radiance": (3,)}, pointer(place), _dimmer(given)
        )

    def _instance_sample(self, given: Parameters, **inputs: np.ndarray) -> Arrays:
        outputs = {"toward": (3,), "pdf_solid_angle": ()}
        return self._ask("instance_sample", inputs, outputs, pointer(_to_world(given)))

    def _view(self, given: Parameters, origin: np.ndarray, direction: np.ndarray) -> Arrays:
        """Light along rays, with what comes through of the background where they meet the lamp."""
        behind = np.array(given["background"], np.float64)
        seen = np.tile(behind, (len(origin), 1))
        ray, *met = self._met(given, origin, direction)
        surface = dict(zip(("position", "normal", "outgoing"), met, strict=True))
        place, shape = _to_world(given), {"transmittance": (3,)}
        through = self._ask("instance_transmittance", surface, shape, pointer(place))
        light = self._instance_radiance(given, **surface)["radiance"]
        seen[ray] = light + through["transmittance"] * behind
        return {"radiance": seen}

    def _met(
        self, given: Parameters, origin: np.ndarray, direction: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Rays that meet the lamp, and position, normal and outgoing there, in the world."""
        place = Placement.of(given.get("to_world", np.eye(4)), "the lamp")
        start, toward = place.point_to_local(origin), place.direction_to_local(direction)
        hits = self._lamp()[1].intersect(start, toward)
        position = place.point_to_world(hits.position)
        return hits.ray, position, place.direction_to_world(hits.normal), -direction[hits.ray]

    def _estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        drawn = self._instance_sample(given, point=point, u=u)
        toward, pdf = drawn["toward"].astype(np.float64), drawn["pdf_solid_angle"]
        ray, *met = self._met(given, point, toward)
        surface = dict(zip(("position", "normal", "outgoing"), met, strict=True))
        radiance = np.zeros((len(point), 3))
        radiance[ray] = self._instance_radiance(given, **surface)["radiance"]
        return {"irradiance": light_estimate(radiance, (toward * normal).sum(1), pdf)}

    def _map_estimate(
        self, given: Parameters, point: np.ndarray, normal: np.ndarray, u: np.ndarray
    ) -> Arrays:
        place, inputs = _to_world(given), {"point": point, "u": u}
        outputs = {"radiance": (3,), "toward": (3,), "pdf_solid_angle": ()}
        drawn = self._ask("instance_sample_map", inputs, outputs, pointer(place), _dimmer(given))
        cosine = (drawn["toward"] * normal).sum(1)
        light = light_estimate(drawn["radiance"], cosine, drawn["pdf_solid_angle"])
        return {"irradiance": light}


def _shaped(outputs: Shapes, results: Sequence[np.ndarray]) -> Arrays:
    pairs = zip(outputs.items(), results, strict=True)
    return {name: result.reshape(len(result), *shape) for (name, shape), result in pairs}


def _to_world(given: Parameters) -> np.ndarray:
    return np.array(given.get("to_world", np.eye(4)), np.float64).reshape(16)


def _dimmer(given: Parameters) -> ctypes.c_double:
    return ctypes.c_double(given.get("dimmer", 1.0))


def main() -> int:
    """Answers until its input ends."""
    with tempfile.TemporaryDirectory(prefix="purelight-") as folder:
        return protocol.serve(CppHost(Path(folder)))


if __name__ == "__main__":
    sys.exit(main())
