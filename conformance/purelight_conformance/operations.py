"""What a host may be asked for, computed by the book: the reference of the suite.

Every operation calculates in a given floating-point type; networks go through the reference
evaluator. Equation numbers refer to spec/measures.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from purelight_format import measures, members
from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.members.manifest import Manifest
from purelight_format.members.surface import Surface
from purelight_format.networks import reference
from purelight_format.networks.golden import shaken
from purelight_format.networks.vectors import SIGNATURES, Shapes

Arrays = dict[str, np.ndarray]
UNEVEN = 1e-4  # What a transform may differ from a rotation and a uniform scale.
EDGE = 1e-3  # Rays this near to an edge of a triangle, in barycentric units, prove nothing.


@dataclass(frozen=True)
class Lamp:
    """A bundle as the operations use it.

    Arguments:
        models: ONNX bytes by network.
    """

    manifest: Manifest
    surface: Surface
    models: Mapping[str, bytes]

    @staticmethod
    def of(bundle: Bundle) -> Lamp:
        names = [name for name in bundle.manifest.networks if name in SIGNATURES]
        models = {name: bundle.read(members.network(name)) for name in names}
        return Lamp(bundle.manifest, bundle.surface(), models)

    def shaken(self, rng: np.random.Generator) -> Lamp:
        """The lamp with its weights rounded differently."""
        return replace(self, models={k: shaken(model, rng) for k, model in self.models.items()})

    def __call__(self, network: str, dtype: Any, **inputs: np.ndarray) -> Arrays:
        return reference.evaluate(self.models[network], inputs, dtype)


@dataclass(frozen=True)
class Instance:
    """Where a lamp hangs: world = scale · rotation · local + translation.

    Arguments:
        rotation: [3, 3].
        scale: above zero.
        translation: [3] in metres.
        dimmer: factor on the radiance.
    """

    rotation: np.ndarray
    scale: float
    translation: np.ndarray
    dimmer: float

    @staticmethod
    def of(parameters: Mapping[str, Any], dtype: Any) -> Instance:
        """Takes `to_world`, a row-major 4 x 4 matrix, apart.

        Raises:
            PureLightError: If it mirrors, shears, or scales unevenly.
        """
        matrix = np.array(parameters.get("to_world", np.eye(4)), np.float64).reshape(4, 4)
        volume = np.linalg.det(matrix[:3, :3])
        if not volume > 0:
            raise PureLightError("to_world mirrors or flattens the lamp")
        scale = float(np.cbrt(volume))
        rotation = matrix[:3, :3] / scale
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > UNEVEN:
            raise PureLightError("to_world shears the lamp or scales it unevenly")
        dimmer = float(parameters.get("dimmer", 1.0))
        return Instance(rotation.astype(dtype), scale, matrix[:3, 3].astype(dtype), dimmer)

    def point(self, point: np.ndarray) -> np.ndarray:
        """World to luminaire frame."""
        scale = point.dtype.type(self.scale)
        return ((point - self.translation) @ self.rotation) / scale

    def direction(self, direction: np.ndarray) -> np.ndarray:
        """World to luminaire frame."""
        return direction @ self.rotation

    def to_world(self, direction: np.ndarray) -> np.ndarray:
        """Directions from the luminaire frame to the world."""
        return direction @ self.rotation.T


@dataclass(frozen=True)
class Query:
    """One question to the reference.

    Arguments:
        lamp: None for operations on pure geometry.
        parameters: of the whole call.
        inputs: [N, ...] by name, already in the type to calculate in.
    """

    lamp: Lamp | None
    parameters: Mapping[str, Any]
    inputs: Arrays
    dtype: Any

    def __getitem__(self, name: str) -> np.ndarray:
        return self.inputs[name]

    @property
    def asset(self) -> Lamp:
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
    def instance(self) -> Instance:
        return Instance.of(self.parameters, self.dtype)


# Geometry


def _frame(ask: Query) -> Arrays:
    tangent, bitangent = measures.frame(ask["axis"])
    return {"tangent": tangent, "bitangent": bitangent}


def _cap(ask: Query) -> Arrays:
    cap = measures.cap(ask["point"], ask.sphere)
    return {
        "axis": cap.axis,
        "one_minus_cos": cap.one_minus_cos,
        "outside": cap.outside.astype(ask.dtype),
    }


def _cap_to_direction(ask: Query) -> Arrays:
    cap = measures.cap(ask["point"], ask.sphere)
    pdf = np.where(cap.outside, 1 / cap.solid_angle, 0)
    return {"toward": measures.cap_to_direction(ask["u"], cap), "pdf_solid_angle": pdf}


def _direction_to_cap(ask: Query) -> Arrays:
    cap = measures.cap(ask["point"], ask.sphere)
    square, inside = measures.direction_to_cap(ask["toward"], cap)
    return {"u": square, "inside": inside.astype(ask.dtype)}


def _area_to_solid_angle(ask: Query) -> Arrays:
    """Eq. 8."""
    offset = ask["position"] - ask["point"]
    square = (offset * offset).sum(1)
    cosine = np.abs((offset * ask["normal"]).sum(1)) / np.sqrt(square)
    return {"pdf_solid_angle": ask["pdf_area"] * square / cosine}


# Networks, alone and in the world


def _network(name: str) -> Callable[[Query], Arrays]:
    return lambda ask: ask.asset(name, ask.dtype, **ask.inputs)


def _surface(ask: Query, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray) -> Arrays:
    """Inputs of appearance and transparency: the luminaire frame, the normal's side mended."""
    place = ask.instance
    normal, outgoing = place.direction(normal), place.direction(outgoing)
    facing = (normal * outgoing).sum(1, keepdims=True) >= 0
    normal = np.where(facing, normal, -normal)
    return {"position": place.point(position), "normal": normal, "outgoing": outgoing}


def _radiance(ask: Query, surface: Arrays) -> np.ndarray:
    radiance = ask.asset("appearance", ask.dtype, **surface)["radiance"]
    return radiance * ask.dtype(ask.instance.dimmer)


def _instance_radiance(ask: Query) -> Arrays:
    """Eq. 11."""
    surface = _surface(ask, ask["position"], ask["normal"], ask["outgoing"])
    return {"radiance": _radiance(ask, surface)}


def _instance_sample(ask: Query) -> Arrays:
    point = ask.instance.point(ask["point"])
    result = ask.asset("sampler", ask.dtype, point=point, u=ask["u"])
    toward = ask.instance.to_world(result["toward"])
    return {"toward": toward, "pdf_solid_angle": result["pdf_solid_angle"]}


# Rays


@dataclass(frozen=True)
class Hits:
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


def intersect(lamp: Lamp, origin: np.ndarray, direction: np.ndarray) -> Hits:
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
    return Hits(valid, position, (cross / area[:, None])[first], ~near.any(1))


def _view(ask: Query) -> Arrays:
    """Radiance along rays: that of the lamp, and what is behind as far as the lamp lets it pass."""
    place = ask.instance
    direction = place.direction(ask["direction"])
    hits = intersect(ask.asset, place.point(ask["origin"]), direction)
    surface = _facing(hits, -direction)
    background = np.array(ask.parameters["background"], ask.dtype)
    through = np.zeros((len(direction), 3), ask.dtype)
    if "transparency" in ask.asset.models:
        through = ask.asset("transparency", ask.dtype, **surface)["transmittance"]
    seen = _radiance(ask, surface) + through * background
    return {"radiance": np.where(hits.valid[:, None], seen, background)}


def _facing(hits: Hits, outgoing: np.ndarray) -> Arrays:
    facing = (hits.normal * outgoing).sum(1, keepdims=True) >= 0
    normal = np.where(facing, hits.normal, -hits.normal)
    return {"position": hits.position, "normal": normal, "outgoing": outgoing}


def _estimate(ask: Query) -> Arrays:
    """Eq. 10 with f = 1: irradiance of a surface from one sample."""
    drawn = _instance_sample(ask)
    toward, pdf = drawn["toward"], drawn["pdf_solid_angle"]
    place = ask.instance
    direction = place.direction(toward)
    hits = intersect(ask.asset, place.point(ask["point"]), direction)
    cosine = np.maximum((toward * ask["normal"]).sum(1), 0)
    lit = hits.valid & (pdf > 0)
    weight = np.where(lit, cosine / np.where(lit, pdf, 1), 0)
    return {"irradiance": _radiance(ask, _facing(hits, -direction)) * weight[:, None]}


def _map_estimate(ask: Query) -> Arrays:
    """Irradiance from one sample of the map (Eq. 13): a cell by its luminance, evenly inside it."""
    local = ask.instance.point(ask["point"])
    cap = measures.cap(local, ask.sphere)
    cells = ask.asset("fast_map", ask.dtype, point=local)["radiance_map"].reshape(-1, 256, 3)
    power = cells @ LUMINANCE.astype(ask.dtype)
    before = np.cumsum(power, 1)
    total = before[:, -1:]
    target = ask["u"][:, :1] * total
    chosen = np.minimum((before <= target).sum(1), 255)
    rows = np.arange(len(chosen))
    own = power[rows, chosen]
    lit = cap.outside & (own > 0)
    safe = np.where(own > 0, own, 1)
    inner = np.clip(1 - (before[rows, chosen] - target[:, 0]) / safe, 0, 1)
    square = np.stack(((chosen % 16 + inner) / 16, (chosen // 16 + ask["u"][:, 1]) / 16), 1)
    share = np.where(lit, total[:, 0] / (safe * 256) * cap.solid_angle, 0)
    weight = cells[rows, chosen] * share[:, None] * ask.dtype(ask.instance.dimmer)
    toward = ask.instance.to_world(measures.cap_to_direction(square, cap))
    cosine = np.maximum((toward * ask["normal"]).sum(1, keepdims=True), 0)
    return {"irradiance": weight * cosine}


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
        self, lamp: Lamp | None, parameters: Mapping[str, Any], inputs: Arrays, dtype: Any
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
