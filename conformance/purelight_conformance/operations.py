"""What a host may be asked for, computed by the book: the reference of the suite.

Every operation calculates in a given floating-point type; networks go through the reference
evaluator. Equation numbers refer to spec/measures.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from purelight_format import measures, members, reflection
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere, Cap, Placement
from purelight_format.members import finishes
from purelight_format.members.finishes import Finish
from purelight_format.members.manifest import Manifest
from purelight_format.members.manifest_reader import Reader
from purelight_format.members.surface import Surface
from purelight_format.networks import reference
from purelight_format.networks.golden import shaken
from purelight_format.networks.vectors import SIGNATURES, Shapes

Arrays = dict[str, np.ndarray]
EDGE = 1e-3  # Rays this near to an edge of a triangle, in barycentric units, prove nothing.


@dataclass(frozen=True)
class Asset:
    """A bundle as the operations use it.

    Arguments:
        models: ONNX bytes by network.
    """

    manifest: Manifest
    surface: Surface
    models: Mapping[str, bytes]

    @staticmethod
    def of(bundle: Bundle) -> Asset:
        names = [name for name in bundle.manifest.networks if name in SIGNATURES]
        models = {name: bundle.read(members.network(name)) for name in names}
        return Asset(bundle.manifest, bundle.surface(), models)

    def shaken(self, rng: np.random.Generator) -> Asset:
        """The lamp with its weights rounded differently."""
        return replace(self, models={k: shaken(model, rng) for k, model in self.models.items()})

    def __call__(self, network: str, dtype: Any, **inputs: np.ndarray) -> Arrays:
        return reference.evaluate(self.models[network], inputs, dtype)


@dataclass(frozen=True)
class Query:
    """One question to the reference.

    Arguments:
        lamp: None for operations on pure geometry.
        parameters: of the whole call.
        inputs: [N, ...] by name, already in the type to calculate in.
    """

    lamp: Asset | None
    parameters: Mapping[str, Any]
    inputs: Arrays
    dtype: Any

    def __getitem__(self, name: str) -> np.ndarray:
        return self.inputs[name]

    @property
    def asset(self) -> Asset:
        assert self.lamp is not None  # Operations that need one are only put with one.
        return self.lamp

    @property
    def sphere(self) -> BoundingSphere:
        if self.lamp:
            return self.lamp.manifest.bounding_sphere
        given = self.parameters["bounding_sphere"]
        x, y, z = given["center"]
        return BoundingSphere((x, y, z), given["radius"])

    @property
    def finish(self) -> Finish:
        return finishes.read(Reader(self.parameters["finish"], "finish"))

    @property
    def seen(self) -> Cap[np.ndarray]:
        """The cap that `point` sees."""
        return measures.cap(self["point"], self.sphere)

    @property
    def instance(self) -> Placement:
        """Where `to_world`, a row-major 4 x 4 matrix, hangs the lamp."""
        return Placement.of(self.parameters.get("to_world", np.eye(4)), "the lamp", self.dtype)

    @property
    def dimmer(self) -> float:
        return float(self.parameters.get("dimmer", 1.0))


# Geometry


def _frame(ask: Query) -> Arrays:
    tangent, bitangent = measures.frame(ask["axis"])
    return {"tangent": tangent, "bitangent": bitangent}


def _cap(ask: Query) -> Arrays:
    cap = ask.seen
    return {
        "axis": cap.axis,
        "one_minus_cos": cap.one_minus_cos,
        "outside": cap.outside.astype(ask.dtype),
    }


def _cap_to_direction(ask: Query) -> Arrays:
    cap = ask.seen
    pdf = np.where(cap.outside, 1 / cap.solid_angle, 0)
    return {"toward": measures.cap_to_direction(ask["u"], cap), "pdf_solid_angle": pdf}


def _direction_to_cap(ask: Query) -> Arrays:
    square, inside = measures.direction_to_cap(ask["toward"], ask.seen)
    return {"u": square, "inside": inside.astype(ask.dtype)}


def _area_to_solid_angle(ask: Query) -> Arrays:
    return {"pdf_solid_angle": measures.area_to_solid_angle(**ask.inputs)}


def _finish(ask: Query) -> Arrays:
    """Eqs. 14 to 22."""
    return vars(reflection.answer(ask.finish, **ask.inputs))


# Networks, alone and in the world


def _network(name: str) -> Callable[[Query], Arrays]:
    return lambda ask: ask.asset(name, ask.dtype, **ask.inputs)


def _surface(ask: Query, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray) -> Arrays:
    """Inputs of appearance and transparency: the luminaire frame, the normal's side mended."""
    place = ask.instance
    normal, outgoing = place.direction_to_local(normal), place.direction_to_local(outgoing)
    facing = (normal * outgoing).sum(1, keepdims=True) >= 0
    normal = np.where(facing, normal, -normal)
    return {"position": place.point_to_local(position), "normal": normal, "outgoing": outgoing}


def _radiance(ask: Query, surface: Arrays) -> np.ndarray:
    radiance = ask.asset("appearance", ask.dtype, **surface)["radiance"]
    return radiance * ask.dtype(ask.dimmer)


def _instance_radiance(ask: Query) -> Arrays:
    """Eq. 11."""
    surface = _surface(ask, ask["position"], ask["normal"], ask["outgoing"])
    return {"radiance": _radiance(ask, surface)}


def _instance_sample(ask: Query) -> Arrays:
    place = ask.instance
    point = place.point_to_local(ask["point"])
    result = ask.asset("sampler", ask.dtype, point=point, u=ask["u"])
    toward = place.direction_to_world(result["toward"])
    return {"toward": toward, "pdf_solid_angle": result["pdf_solid_angle"]}


# Rays


@dataclass(frozen=True)
class FirstHits:
    """Where rays of the luminaire frame first meet the exit surface.

    Arguments:
        valid: [N] whether they do.
        position, normal: [N, 3], the normal on either side.
        clear: [N] whether no edge was near.
    """

    valid: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    clear: np.ndarray


def intersect(lamp: Asset, origin: np.ndarray, direction: np.ndarray) -> FirstHits:
    """Every ray against every triangle, of those that have an area."""
    dtype, radius = origin.dtype, lamp.manifest.bounding_sphere.radius
    corners = (lamp.surface.positions / radius).astype(dtype)[lamp.surface.triangles]
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    cross = np.cross(ab, ac)
    area = np.linalg.norm(cross, axis=1)
    solid = area > 1e-12
    a, ab, ac, cross, area = (value[solid] for value in (a, ab, ac, cross, area))
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = direction @ cross.T
        start = origin[:, None] / dtype.type(radius) - a
        depth = -(start * cross).sum(-1) / speed
        at = start + depth[..., None] * direction[:, None]
        v = (np.cross(at, ac) * cross).sum(-1) / area**2
        w = (np.cross(ab, at) * cross).sum(-1) / area**2
    margin = np.minimum(np.minimum(v, w), 1 - v - w)
    meets = (margin >= 0) & (depth > 0)
    first = np.where(meets, depth, np.inf).argmin(1)
    rows = np.arange(len(origin))
    valid = meets[rows, first]
    reach = np.where(valid, depth[rows, first], 0) * dtype.type(radius)
    position = origin + reach[:, None] * direction
    centre = np.array(lamp.manifest.bounding_sphere.center, dtype)
    position = np.where(valid[:, None], position, centre)  # A harmless place to ask networks of.
    near = (np.abs(margin) < EDGE) & (depth > 0)
    return FirstHits(valid, position, (cross / area[:, None])[first], ~near.any(1))


def _view(ask: Query) -> Arrays:
    """Radiance along rays: that of the lamp, and what is behind as far as the lamp lets it pass."""
    place = ask.instance
    direction = place.direction_to_local(ask["direction"])
    hits = intersect(ask.asset, place.point_to_local(ask["origin"]), direction)
    surface = _facing(hits, -direction)
    background = np.array(ask.parameters["background"], ask.dtype)
    through = np.zeros((len(direction), 3), ask.dtype)
    if "transparency" in ask.asset.models:
        through = ask.asset("transparency", ask.dtype, **surface)["transmittance"]
    seen = _radiance(ask, surface) + through * background
    return {"radiance": np.where(hits.valid[:, None], seen, background)}


def _facing(hits: FirstHits, outgoing: np.ndarray) -> Arrays:
    facing = (hits.normal * outgoing).sum(1, keepdims=True) >= 0
    normal = np.where(facing, hits.normal, -hits.normal)
    return {"position": hits.position, "normal": normal, "outgoing": outgoing}


def _estimate(ask: Query) -> Arrays:
    """Irradiance of a surface from one sample (Eq. 10)."""
    drawn, place = _instance_sample(ask), ask.instance
    direction = place.direction_to_local(drawn["toward"])
    hits = intersect(ask.asset, place.point_to_local(ask["point"]), direction)
    radiance = np.where(hits.valid[:, None], _radiance(ask, _facing(hits, -direction)), 0)
    return _irradiance(ask, radiance, **drawn)


def _map_estimate(ask: Query) -> Arrays:
    """Irradiance of a surface from one sample of the map (Eq. 13)."""
    place = ask.instance
    local = place.point_to_local(ask["point"])
    radiance_map = ask.asset("fast_map", ask.dtype, point=local)["radiance_map"]
    view = measures.cap(local, ask.sphere)
    radiance, toward, pdf = measures.draw_from_map(radiance_map, ask["u"], view)
    return _irradiance(ask, radiance * ask.dtype(ask.dimmer), place.direction_to_world(toward), pdf)


def _irradiance(
    ask: Query, radiance: np.ndarray, toward: np.ndarray, pdf_solid_angle: np.ndarray
) -> Arrays:
    cosine = (toward * ask["normal"]).sum(1)
    return {"irradiance": measures.light_estimate(radiance, cosine, pdf_solid_angle)}


# The table


@dataclass(frozen=True)
class Operation:
    """Something a host can be asked for.

    Arguments:
        inputs, outputs: shapes of one row by name.
        run: the reference.
        needs: the networks of the bundle; without any it is pure geometry and gets no bundle.
        parameters: names of what a whole call may set.
    """

    inputs: Shapes
    outputs: Shapes
    run: Callable[[Query], Arrays]
    needs: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()

    def __call__(
        self, lamp: Asset | None, parameters: Mapping[str, Any], inputs: Arrays, dtype: Any
    ) -> Arrays:
        """Evaluates rows [N, ...]."""
        typed = {name: np.asarray(array, dtype) for name, array in inputs.items()}
        return self.run(Query(lamp, parameters, typed, dtype))


POINT: Shapes = {"point": (3,)}
DIRECTION: Shapes = {"toward": (3,)}
SQUARE: Shapes = {"u": (2,)}
SPHERE, INSTANCE = ("bounding_sphere",), ("to_world", "dimmer")
PDF: Shapes = {"pdf_solid_angle": ()}
SURFACE: Shapes = {"position": (3,), "normal": (3,), "outgoing": (3,)}

OPERATIONS = {
    **{
        name: Operation(signature.inputs, signature.outputs, _network(name), (name,))
        for name, signature in SIGNATURES.items()
    },
    "frame": Operation({"axis": (3,)}, {"tangent": (3,), "bitangent": (3,)}, _frame),
    "square_to_disk": Operation(
        SQUARE, {"disk": (2,)}, lambda ask: {"disk": measures.square_to_disk(ask["u"])}
    ),
    "disk_to_square": Operation(
        {"disk": (2,)}, SQUARE, lambda ask: {"u": measures.disk_to_square(ask["disk"])}
    ),
    "cap": Operation(
        POINT, {"axis": (3,), "one_minus_cos": (), "outside": ()}, _cap, parameters=SPHERE
    ),
    "cap_to_direction": Operation(
        POINT | SQUARE, DIRECTION | PDF, _cap_to_direction, parameters=SPHERE
    ),
    "direction_to_cap": Operation(
        POINT | DIRECTION, SQUARE | {"inside": ()}, _direction_to_cap, parameters=SPHERE
    ),
    "area_to_solid_angle": Operation(
        POINT | {"position": (3,), "normal": (3,), "pdf_area": ()}, PDF, _area_to_solid_angle
    ),
    "finish": Operation(
        {"normal": (3,), "outgoing": (3,), "incoming": (3,), "transmittance": (3,)},
        {"reflected": (3,), "mirrored": (3,), "spread": (3,), "straight": (3,)},
        _finish, parameters=("finish",),
    ),
    "instance_radiance": Operation(
        SURFACE, {"radiance": (3,)}, _instance_radiance, ("appearance",), INSTANCE
    ),
    "instance_sample": Operation(
        POINT | SQUARE, DIRECTION | PDF, _instance_sample, ("sampler",), INSTANCE
    ),
    "view": Operation(
        {"origin": (3,), "direction": (3,)}, {"radiance": (3,)}, _view, ("appearance",),
        (*INSTANCE, "background"),
    ),
    "estimate": Operation(
        POINT | {"normal": (3,)} | SQUARE, {"irradiance": (3,)}, _estimate,
        ("appearance", "sampler"), INSTANCE,
    ),
    "map_estimate": Operation(
        POINT | {"normal": (3,)} | SQUARE, {"irradiance": (3,)}, _map_estimate, ("fast_map",),
        INSTANCE,
    ),
}  # fmt: skip
