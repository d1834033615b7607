"""This runtime as a host of the conformance suite: `python -m purelight_mitsuba.conformance_host`.

It answers with the parts that rendering is made of: the fused networks, the cap, the lamps of a
scene and their queries, and for whole rays the integrator itself.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from purelight_conformance import protocol
from purelight_conformance.operations import OPERATIONS
from purelight_format.errors import PureLightError
from purelight_format.members.finishes import read
from purelight_format.members.manifest_reader import Reader
from purelight_format.networks.vectors import SIGNATURES
from purelight_mitsuba.platform import use

mi = use()

import drjit as dr  # noqa: E402 - only once Mitsuba has a variant
import numpy as np  # noqa: E402

from purelight_mitsuba.lamps.exits import Hit  # noqa: E402
from purelight_mitsuba.lamps.finish_bsdf import FinishBSDF, ScatterBSDF  # noqa: E402
from purelight_mitsuba.lamps.finishes import Finishes  # noqa: E402
from purelight_mitsuba.lamps.luminaire import Luminaire, load  # noqa: E402
from purelight_mitsuba.lamps.table import Lamps, Place  # noqa: E402
from purelight_mitsuba.sampling.cap import Cap, cap, frame  # noqa: E402
from purelight_mitsuba.translate.golden import evaluate, lanes, rows_of  # noqa: E402
from purelight_mitsuba.transport.events import Parts  # noqa: E402
from purelight_mitsuba.transport.queries import ExitRay, Queries  # noqa: E402

Arrays = dict[str, np.ndarray]
Parameters = Mapping[str, Any]


class World:
    """One lamp in a scene, and what the integrator asks of it.

    Arguments:
        path: of the bundle.
        given: the call's `to_world`, `dimmer` and `background`.
        rows: how many lanes.

    Raises:
        PureLightError: If the lamp cannot hang like that.
    """

    def __init__(self, path: Path, given: Parameters, rows: int, *, fast: bool = False) -> None:
        matrix = np.reshape(given.get("to_world", np.eye(4)), (4, 4)).astype(np.float64)
        content: dict[str, Any] = {"type": "scene"}
        content["lamp"] = {
            "type": "purelight",
            "filename": str(path),
            "to_world": mi.ScalarTransform4f(matrix),
            "dimmer": float(given.get("dimmer", 1.0)),
        }
        if "background" in given:
            colour = {"type": "rgb", "value": list(given["background"])}
            content["background"] = {"type": "constant", "radiance": colour}
        try:
            self.scene = mi.load_dict(content)
        except RuntimeError as error:
            raise PureLightError(str(error).splitlines()[-1]) from error
        emitters = [e for e in self.scene.emitters() if hasattr(e, "luminaire")]
        self.lamps = Lamps(emitters, self.scene)
        self.queries = Queries(self.lamps, fast=fast)
        self.active = dr.full(mi.Bool, True, rows)
        self.place: Place = self.lamps.place(dr.zeros(mi.UInt32, rows), self.active)


class MitsubaHost:
    """The runtime on the variant in use."""

    name = "purelight-mitsuba"
    version = metadata.version("purelight")
    operations: tuple[str, ...] = (
        *SIGNATURES, "frame", "square_to_disk", "cap", "cap_to_direction", "finish",
        "instance_radiance", "instance_sample", "view", "estimate", "map_estimate", protocol.READER,
    )  # fmt: skip

    def __init__(self) -> None:
        self._lamp: Luminaire | None = None

    def open(self, path: str) -> None:
        self._lamp = None
        lamp = load(Path(path))
        for network in filter(lamp.has, SIGNATURES):
            lamp.network(network)  # Translated now, so that its golden vectors are compared.
        self._lamp = lamp

    @property
    def lamp(self) -> Luminaire:
        if self._lamp is None:
            raise PureLightError("open a bundle first")
        return self._lamp

    def evaluate(self, operation: str, parameters: Parameters, inputs: Arrays) -> Arrays:
        shapes, rows = OPERATIONS[operation].outputs, len(next(iter(inputs.values())))
        if rows == 0:  # Dr.Jit has no arrays without lanes.
            return {name: np.zeros((0, *shape), np.float32) for name, shape in shapes.items()}
        if operation in SIGNATURES:
            return evaluate(self.lamp.network(operation), operation, inputs)
        columns = {name: lanes(array) for name, array in inputs.items()}
        values = getattr(self, f"_{operation}")(parameters, rows, **columns)
        return {
            name: rows_of(value, rows, shape)
            for (name, shape), value in zip(shapes.items(), values, strict=True)
        }

    # Geometry

    def _frame(self, _: Parameters, rows: int, axis: Any) -> list[Any]:
        tangent, bitangent, _axis = frame(mi.Vector3f(axis))
        return [tangent, bitangent]

    def _square_to_disk(self, _: Parameters, rows: int, u: Any) -> list[Any]:
        return [mi.warp.square_to_uniform_disk_concentric(u)]

    def _cap(self, given: Parameters, rows: int, point: Any) -> list[Any]:
        view = _view_of(given, point)
        return [view.axis, view.one_minus_cos, mi.Float(view.outside)]

    def _cap_to_direction(self, given: Parameters, rows: int, point: Any, u: Any) -> list[Any]:
        view = _view_of(given, point)
        return [view.direction(u), view.pdf_solid_angle()]

    def _finish(
        self, given: Parameters, rows: int, normal: Any, outgoing: Any, incoming: Any,
        transmittance: Any,
    ) -> list[Any]:  # fmt: skip
        """As a path has it: its BSDFs on a triangle, and what it draws from."""
        finishes = Finishes([read(Reader(given["finish"], "finish"))])
        sides = dr.zeros(mi.UInt32, 2)
        si = dr.zeros(mi.SurfaceInteraction3f, rows)
        si.n, si.sh_frame = mi.Normal3f(normal), mi.Frame3f(mi.Vector3f(normal))
        si.wi, wo = si.to_local(mi.Vector3f(outgoing)), si.to_local(mi.Vector3f(incoming))
        context, active = mi.BSDFContext(), dr.full(mi.Bool, True, rows)
        reflected = FinishBSDF(finishes, sides).eval(context, si, wo, active)
        scatter = ScatterBSDF(finishes, sides)
        ahead = scatter.eval(context, si, wo, active)
        si.prim_index += 1
        back = scatter.eval(context, si, wo, active)
        look = finishes.look(dr.zeros(mi.UInt32, rows), active)
        parts = Parts.of(look, si.wi.z, mi.Color3f(transmittance))
        mirrored = dr.select(look.sharp, look.reflectance(si.wi.z), 0)
        return [reflected, mirrored, parts.ahead * ahead, parts.back * back, parts.straight]

    # The lamp in the world

    def _world(self, given: Parameters, rows: int, *, fast: bool = False) -> World:
        return World(self.lamp.path, given, rows, fast=fast)

    def _instance_radiance(
        self, given: Parameters, rows: int, position: Any, normal: Any, outgoing: Any
    ) -> list[Any]:
        world = self._world(given, rows)
        zero, local = dr.zeros(mi.UInt32, rows), world.place.direction_to_local(normal)
        hit = Hit(
            valid=world.active, t=mi.Float(zero), lamp=zero, facet=zero, normal=mi.Normal3f(local)
        )
        ray = ExitRay.of(world.place, hit, position, -mi.Vector3f(outgoing))
        return [world.queries.radiance(world.place, ray, world.active).value]

    def _instance_sample(self, given: Parameters, rows: int, point: Any, u: Any) -> list[Any]:
        world = self._world(given, rows)
        aim = world.queries.aim(world.place, point, u, world.active)
        return [aim.toward, aim.pdf_solid_angle]

    def _view(self, given: Parameters, rows: int, origin: Any, direction: Any) -> list[Any]:
        scene = self._world(given, rows).scene
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(0, rows)
        ray = mi.RayDifferential3f(origin, mi.Vector3f(direction))
        radiance, *_ = mi.load_dict({"type": "purelight"}).sample(scene, sampler, ray)
        return [radiance]

    def _estimate(self, given: Parameters, rows: int, point: Any, normal: Any, u: Any) -> list[Any]:
        world = self._world(given, rows)
        aim = world.queries.aim(world.place, point, u, world.active)
        toward, hit = aim.toward, world.lamps.intersect(mi.Ray3f(point, aim.toward), world.active)
        ray = ExitRay.of(world.place, hit, point + toward * hit.t, toward)
        radiance = world.queries.radiance(world.place, ray, hit.valid).value
        cosine = dr.maximum(dr.dot(toward, mi.Vector3f(normal)), 0)
        return [dr.select(hit.valid, radiance * aim.weight * cosine, 0)]

    def _map_estimate(
        self, given: Parameters, rows: int, point: Any, normal: Any, u: Any
    ) -> list[Any]:
        world = self._world(given, rows, fast=True)
        aim = world.queries.aim(world.place, point, u, world.active)
        return [aim.weight * dr.maximum(dr.dot(aim.toward, mi.Vector3f(normal)), 0)]


def _view_of(given: Parameters, point: Any) -> Cap:
    sphere = given["bounding_sphere"]
    return cap(point, mi.Point3f(*sphere["center"]), mi.Float(sphere["radius"]))


if __name__ == "__main__":
    sys.exit(protocol.serve(MitsubaHost()))
