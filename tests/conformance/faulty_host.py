"""A host that evaluates by the book in float32, but for one planted fault: its argument."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from purelight_conformance import operations, protocol
from purelight_conformance.operations import OPERATIONS, Asset, Query
from purelight_format import measures, reflection
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.measures import Placement
from purelight_format.networks import reference
from purelight_format.validation.report import Report
from purelight_format.validation.validate import validate

Arrays = dict[str, np.ndarray]


class BookHost:
    """Answers with the reference itself."""

    name, version = "by the book", "1"
    operations: tuple[str, ...] = (*OPERATIONS, protocol.READER)

    def __init__(self) -> None:
        self._lamp: Asset | None = None

    def open(self, path: str) -> None:
        self._lamp = None
        if self.refuses(report := validate(path)):
            raise PureLightError(report.issues[0].message if report.issues else "not today")
        self._lamp = Asset.of(Bundle.open(path))

    @staticmethod
    def refuses(report: Report) -> bool:
        return not report.valid

    def evaluate(self, operation: str, parameters: Mapping[str, Any], inputs: Arrays) -> Arrays:
        put = OPERATIONS[operation]
        lamp = self._lamp if put.needs else None
        with np.errstate(all="ignore"):
            return put(lamp, parameters, inputs, np.float32)


def spoil(operation: str, change: Callable[[Query, Arrays], Arrays]) -> None:
    """Changes what the reference answers to an operation."""
    right = OPERATIONS[operation]
    OPERATIONS[operation] = replace(right, run=lambda ask: change(ask, right.run(ask)))


def axis_order() -> None:
    """Y up: the networks get y and z exchanged."""
    right = Asset.__call__

    def ask(lamp: Asset, network: str, dtype: Any, **inputs: np.ndarray) -> Arrays:
        turned = {k: v[:, [0, 2, 1]] if v.shape[1] == 3 else v for k, v in inputs.items()}
        return right(lamp, network, dtype, **turned)

    Asset.__call__ = ask  # type: ignore[method-assign]


def cosine_measure() -> None:
    """Densities per projected solid angle where they should be per solid angle."""

    def estimate(ask: Query, answer: Arrays) -> Arrays:
        local = ask.instance.point_to_local(ask["point"])
        toward = ask.asset("sampler", ask.dtype, point=local, u=ask["u"])["toward"]
        cosine = (ask.instance.direction_to_world(toward) * ask["normal"]).sum(1)
        return {"irradiance": answer["irradiance"] / np.where(cosine > 0, cosine, 1)[:, None]}

    def area(ask: Query, answer: Arrays) -> Arrays:
        offset = ask["position"] - ask["point"]
        cosine = np.abs((offset * ask["normal"]).sum(1)) / np.linalg.norm(offset, axis=1)
        return {"pdf_solid_angle": answer["pdf_solid_angle"] * cosine}

    spoil("estimate", estimate)
    spoil("area_to_solid_angle", area)


def cancellation() -> None:
    """1 - cos as it is written."""
    right = measures.cap

    def cap(point: np.ndarray, sphere: measures.BoundingSphere) -> measures.Cap:
        view = right(point, sphere)
        sine = np.sqrt(view.one_minus_cos * (2 - view.one_minus_cos))
        return replace(view, one_minus_cos=1 - np.sqrt(1 - sine * sine))

    measures.cap = cap


def transposed_map() -> None:
    """Rows of the radiance map for columns."""
    right = Asset.__call__

    def ask(lamp: Asset, network: str, dtype: Any, **inputs: np.ndarray) -> Arrays:
        answer = right(lamp, network, dtype, **inputs)
        return {k: v.swapaxes(1, 2) if k == "radiance_map" else v for k, v in answer.items()}

    Asset.__call__ = ask  # type: ignore[method-assign]


def tf32() -> None:
    """Operands of matrix products with ten bits of mantissa."""
    right = reference.OPERATORS["Gemm"]

    def rounded(x: np.ndarray) -> np.ndarray:
        bits = np.ascontiguousarray(x, np.float32).view(np.uint32)
        return ((bits + np.uint32(0x1000)) & np.uint32(0xFFFFE000)).view(np.float32)

    reference.OPERATORS["Gemm"] = lambda x, weight, bias, **rest: right(
        rounded(x), rounded(weight), bias, **rest
    )


def swapped_channels() -> None:
    """Blue, green, red."""
    for name in ("appearance", "fast_map", "instance_radiance", "view"):
        spoil(name, lambda _, answer: {k: v[..., ::-1] for k, v in answer.items()})


def unturned_normal() -> None:
    """A triangle's normal as the mesh has it."""

    def hits(found: operations.FirstHits, outgoing: np.ndarray) -> Arrays:
        return {"position": found.position, "normal": found.normal, "outgoing": outgoing}

    def surface(ask: Query, position: np.ndarray, normal: np.ndarray, out: np.ndarray) -> Arrays:
        place = ask.instance
        normal, out = map(place.direction_to_local, (normal, out))
        return {"position": place.point_to_local(position), "normal": normal, "outgoing": out}

    operations._facing, operations._surface = hits, surface


def schlick() -> None:
    """Schlick's approximation for what dielectrics reflect."""

    def fresnel(cosine: np.ndarray, ior: float) -> np.ndarray:
        least = ((ior - 1) / (ior + 1)) ** 2
        return least + (ior > 1) * (1 - least) * (1 - np.abs(cosine)) ** 5

    reflection.fresnel = fresnel  # type: ignore[assignment]


def transposed_rotation() -> None:
    """Directions turned the wrong way."""
    Placement.direction_to_local, Placement.direction_to_world = (  # type: ignore[method-assign]
        Placement.direction_to_world, Placement.direction_to_local,
    )  # fmt: skip


def scaled_radiance() -> None:
    """Radiance that grows with the area of an instance."""
    for name in ("instance_radiance", "view"):
        spoil(name, lambda ask, answer: {k: v * ask.instance.scale**2 for k, v in answer.items()})


def uniform_transform_only_in_name() -> None:
    """Any matrix is taken for a rotation and a scale."""
    measures.UNEVEN = measures.STRAIGHT = np.inf


def takes_everything() -> None:
    """A file is never refused; what cannot be read is found out when it is used."""
    right = BookHost.open

    def take(host: BookHost, path: str) -> None:
        with suppress(PureLightError):
            right(host, path)

    BookHost.open = take  # type: ignore[method-assign]


def refuses_everything() -> None:
    """No file is good enough."""
    BookHost.refuses = staticmethod(lambda report: True)  # type: ignore[method-assign]


def refuses_warnings() -> None:
    """A warning is taken for an error."""
    BookHost.refuses = staticmethod(  # type: ignore[method-assign]
        lambda report: bool(report.issues)
    )


def swapped_square() -> None:
    """Directions with the sides of the cap's square exchanged, and their density left as it is."""

    def mirror(ask: Query, answer: Arrays) -> Arrays:
        view = measures.cap(ask["point"], ask.sphere)
        square, _ = measures.direction_to_cap(answer["toward"], view)
        return {**answer, "toward": measures.cap_to_direction(square[:, ::-1], view)}

    spoil("sampler", mirror)


def unnormalised() -> None:
    """Densities too large by half a hundredth."""
    for name in ("sampler", "sampler_pdf"):
        spoil(name, lambda _, answer: {
            **answer, "pdf_solid_angle": answer["pdf_solid_angle"] * np.float32(1.005)
        })  # fmt: skip


def transform_within(tolerance: float) -> None:
    """Transforms are refused by another tolerance than the specification's."""
    measures.UNEVEN = tolerance


def uneven_by_a_hundredth() -> None:
    """Axes may differ by a hundredth."""
    transform_within(1e-2)


def even_to_the_last_digit() -> None:
    """Transforms with the digits that a scene file gives are refused."""
    transform_within(1e-9)


def map_in_the_luminaire_frame() -> None:
    """Directions of the radiance map that are not turned with the instance."""

    def estimate(ask: Query, answer: Arrays) -> Arrays:
        place = ask.instance
        normal = place.direction_to_world(ask["normal"])  # What the reference does is undone.
        turned = replace(ask, inputs={**ask.inputs, "normal": normal})
        return right.run(turned)

    right = OPERATIONS["map_estimate"]
    spoil("map_estimate", estimate)


def mirrored_map() -> None:
    """Cells of the radiance map counted from the other end of their row, where they are drawn."""
    right = measures.draw_from_map
    measures.draw_from_map = lambda radiance_map, u, cap: right(radiance_map[:, :, ::-1], u, cap)


def divides_by_no_density() -> None:
    """Estimates at points where nothing can be drawn are no numbers."""

    def nowhere(ask: Query, answer: Arrays) -> Arrays:
        view = measures.cap(ask.instance.point_to_local(ask["point"]), ask.sphere)
        return {k: np.where(view.outside[:, None], v, np.nan) for k, v in answer.items()}

    for name in ("estimate", "map_estimate"):
        spoil(name, nowhere)


def enters_at_the_sphere() -> None:
    """Rays that begin where they enter the bounding sphere, also those from within it."""

    def view(ask: Query, answer: Arrays) -> Arrays:
        place, sphere = ask.instance, ask.sphere
        local = place.point_to_local(ask["origin"])
        within = np.linalg.norm(local - np.array(sphere.center), axis=1) < sphere.radius
        back = np.where(within, 2 * sphere.radius * place.scale, 0)[:, None]
        origin = (ask["origin"] - back * ask["direction"]).astype(ask.dtype)
        return right.run(replace(ask, inputs={**ask.inputs, "origin": origin}))

    right = OPERATIONS["view"]
    spoil("view", view)


FAULTS = {
    fault.__name__: fault
    for fault in (
        axis_order, cosine_measure, cancellation, transposed_map, tf32, swapped_channels,
        unturned_normal, schlick, transposed_rotation, scaled_radiance,
        uniform_transform_only_in_name,
        takes_everything, refuses_everything, refuses_warnings,
        swapped_square, unnormalised,
        uneven_by_a_hundredth, even_to_the_last_digit, map_in_the_luminaire_frame, mirrored_map,
        divides_by_no_density, enters_at_the_sphere,
    )
}  # fmt: skip

if __name__ == "__main__":
    for name in sys.argv[1:]:
        FAULTS[name]()
    sys.exit(protocol.serve(BookHost()))
