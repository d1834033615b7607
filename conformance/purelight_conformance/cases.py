"""Which vectors the suite has: candidates, the bugs they hunt, and reference values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from purelight_conformance import lamps
from purelight_conformance.candidates import (
    ALL,
    REFUSED,
    TRANSFORMS,
    Arrays,
    Flags,
    Wish,
    ball,
    cosine,
    directions,
    placed,
    placed_flags,
    point_flags,
    squares,
    u_edge,
)  # fmt: skip
from purelight_conformance.operations import OPERATIONS, Asset, intersect
from purelight_conformance.suite import ALLOWED, NEVER, REQUIRED, VectorSet
from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.measures import BoundingSphere, cap, cap_to_direction
from purelight_format.networks import probes
from purelight_format.networks.golden import FLOOR, Evaluation, judge
from purelight_format.networks.probes import Extent

EXACT = 1e-5  # Floor of tolerances where no network is involved.
ROWS = (0, 1, 65_537)
SAMPLES = 1024  # Of the radiance map, for one point.
SIGMAS = 5.0
NOTHING: Mapping[str, Any] = MappingProxyType({})
SMALL_OUTPUTS = {  # What counts as small, where that is neither zero nor the radiance scale.
    "transmittance": 1.0, "toward": 1.0, "tangent": 1.0, "bitangent": 1.0, "axis": 1.0,
    "reflected": 1.0, "mirrored": 1.0, "ahead": 1.0, "back": 1.0, "straight": 1.0,
    "disk": 1.0, "u": 1.0, "inside": 1.0, "outside": 1.0,
}  # fmt: skip
HARD = {
    "red": "RED_ONLY", "black": "BLACK", "faint": "FAINT", "bright": "BRIGHT",
    "millimetre": "MILLIMETRE", "kilometre": "KILOMETRE",
}  # fmt: skip
BACKGROUND = [2.0, 3.0, 4.0]


class Cases:
    """All sets, one after the other.

    Arguments:
        bundles: the suite's lamps by name.
    """

    def __init__(self, bundles: Mapping[str, Bundle]) -> None:
        self._lamps = {name: Asset.of(bundle) for name, bundle in bundles.items()}

    def __iter__(self) -> Iterator[VectorSet]:
        yield from self._networks()
        yield from self._frames()
        yield from self._caps()
        yield from self._finishes()
        yield from self._instances()
        yield from self._composites()
        yield from self._estimators()

    def _set(
        self,
        name: str,
        group: str,
        operation: str,
        bundle: str,
        wish: Wish,
        *,
        rows: int | None = None,
        refusal: str = NEVER,
        compared: Sequence[str] = (),
        parameters: Mapping[str, Any] = NOTHING,
    ) -> VectorSet:
        """Evaluates candidates and keeps those on which rounding has little say.

        Arguments:
            compared: the outputs that count; all if empty.
        """
        put, lamp = OPERATIONS[operation], self._lamps.get(bundle)
        unit = lamp.manifest.radiance_scale if lamp else 0.0
        units = {k: unit if k.startswith("radiance") else SMALL_OUTPUTS.get(k, 0.0)
                 for k in put.outputs}  # fmt: skip

        def evaluation(lamp: Asset | None) -> Evaluation:
            def evaluate(inputs: Arrays, dtype: Any) -> Arrays:
                outputs = put(lamp, parameters, inputs, dtype)
                return {k: outputs[k] for k in compared or outputs}

            return evaluate

        judged = judge(
            wish.float32, evaluation(lamp), units,
            shaking=lambda rng: evaluation(lamp.shaken(rng) if lamp else None),
            floor=FLOOR if lamp else EXACT,
        )  # fmt: skip
        fit = judged.fit if wish.keep is None else judged.fit & wish.keep
        chosen = np.flatnonzero(fit)[: wish.count]
        inputs, outputs, tolerances = (
            {k: array[chosen] for k, array in group_of.items()}
            for group_of in (wish.float32, judged.outputs, judged.tolerances)
        )
        flags = {
            flag: np.flatnonzero(np.broadcast_to(mask, fit.shape)[chosen]).tolist()
            for flag, mask in wish.flags.items()
        }
        flags = {flag: found for flag, found in flags.items() if found}
        return VectorSet(
            f"{group}/{name}", group, operation, bundle, inputs, outputs, tolerances, flags,
            dict(parameters), refusal, rows,
        )  # fmt: skip

    # Networks

    def _networks(self) -> Iterator[VectorSet]:
        for network in self._lamps["wild"].models:
            yield self._of_network("wild", network, 16 if network == "fast_map" else 64)
            for name, flag in HARD.items():
                if network in self._lamps[name].models:
                    yield self._of_network(name, network, 16, flag)
            for rows in ROWS:
                inputs = self._wish("wild", network, 7).inputs
                wish = Wish(inputs, {"ROWS": ALL}, count=min(7, max(1, rows)))
                if rows < 2 or network in ("appearance", "sampler"):
                    yield self._set(f"{rows}-rows", network, network, "wild", wish, rows=rows,
                                    refusal=ALLOWED)  # fmt: skip
        yield self._of_network("finished", "appearance", 16, "OVERSTRICT")
        for name, flag in (("compass", "AXIS_ORDER"), ("paint", "CHANNEL_ORDER")):
            yield self._of_network(name, "appearance", 16, flag)
            yield self._of_network(name, "fast_map", 4, "MAP_ORDER" if name == "compass" else flag)

    def _of_network(
        self, lamp: str, network: str, count: int, flag: str = "PRECISION"
    ) -> VectorSet:
        wish = self._wish(lamp, network, count)
        wish = Wish(wish.inputs, {flag: ALL, **wish.flags}, count=count)
        refusal = ALLOWED if lamp in HARD else NEVER
        return self._set(lamp, network, network, lamp, wish, refusal=refusal)

    def _wish(self, lamp: str, network: str, count: int) -> Wish:
        emission, surface = lamps.LAMPS[lamp].emission, self._lamps[lamp].surface
        inputs = lamps.probe(network, emission, surface, max(64, 2 * count), seed=17)
        flags: Flags = {}
        if "outgoing" in inputs:
            flags["GRAZING"] = np.abs((inputs["normal"] * inputs["outgoing"]).sum(1)) < 0.01
        else:
            flags |= point_flags(inputs["point"], emission.sphere)
        if "u" in inputs:
            flags["U_EDGE"] = u_edge(inputs["u"])
        if "toward" in inputs:
            flags["BESIDE"] = np.arange(len(inputs["toward"])) % 8 == 0
        return Wish(inputs, flags, count=count)

    # Geometry

    def _frames(self) -> Iterator[VectorSet]:
        rng = np.random.default_rng(5)
        tilt = np.array([0, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-12, 1e-30])
        beside = np.stack((tilt * 0.6, tilt * -0.8, -np.sqrt(1 - tilt**2)), 1)
        axis = np.concatenate((np.eye(3), -np.eye(3), beside, directions(64, rng)))
        wish = Wish({"axis": axis}, {"POLE": axis[:, 2] < -0.999})
        yield self._set("axes", "frames", "frame", "", wish)

    def _caps(self) -> Iterator[VectorSet]:
        rng = np.random.default_rng(6)
        u = squares(96, rng)
        diagonal = {"DIAGONAL": np.abs(np.abs(2 * u[:, 0] - 1) - np.abs(2 * u[:, 1] - 1)) < 1e-6}
        yield self._set("square_to_disk", "cap", "square_to_disk", "",
                        Wish({"u": u}, {"U_EDGE": u_edge(u), **diagonal}))  # fmt: skip
        disk = OPERATIONS["square_to_disk"](None, {}, {"u": u}, np.float64)["disk"]
        yield self._set("disk_to_square", "cap", "disk_to_square", "",
                        Wish({"disk": disk}, diagonal))  # fmt: skip
        for name, sphere in (
            ("near", lamps.SPHERE),
            ("small", lamps.SMALL),
            ("large", lamps.LARGE),
        ):
            yield from self._caps_of(name, sphere, u, rng)

    def _caps_of(
        self, name: str, sphere: BoundingSphere, u: np.ndarray, rng: np.random.Generator
    ) -> Iterator[VectorSet]:
        point = probes.points(sphere, 1e4, len(u), rng)
        flags = point_flags(point, sphere)
        size = {"small": "MILLIMETRE", "large": "KILOMETRE"}.get(name)
        flags |= {size: ALL} if size else {}
        given = {"bounding_sphere": {"center": list(sphere.center), "radius": sphere.radius}}
        yield self._set(
            f"cap-{name}", "cap", "cap", "", Wish({"point": point}, flags), parameters=given
        )
        wish = Wish({"point": point, "u": u}, flags | {"U_EDGE": u_edge(u)})
        yield self._set(
            f"to_direction-{name}", "cap", "cap_to_direction", "", wish, parameters=given
        )
        view = cap(point.astype(np.float64), sphere)
        toward = cap_to_direction(u * 0.9 + 0.05, view)
        toward[::8] = -toward[::8]
        wish = Wish({"point": point, "toward": toward},
                    flags | {"BESIDE": np.arange(len(u)) % 8 == 0})  # fmt: skip
        yield self._set(f"to_square-{name}", "cap", "direction_to_cap", "", wish, parameters=given)
        wish = Wish({"point": point, "toward": -view.axis}, {"BEHIND": ALL}, count=16)
        yield self._set(f"behind-{name}", "cap", "direction_to_cap", "", wish,
                        compared=("inside",), parameters=given)  # fmt: skip

    # Finishes

    def _finishes(self) -> Iterator[VectorSet]:
        """Light from all around, near the mirror direction, and grazing; both sides of normals."""
        rng, count = np.random.default_rng(12), 160
        normal, outgoing = directions(count, rng), directions(count, rng)
        outgoing[::8] -= 0.97 * cosine(outgoing, normal)[::8, None] * normal[::8]
        incoming, through = directions(count, rng), rng.random((count, 3))
        mirror = 2 * cosine(outgoing, normal)[:, None] * normal - outgoing
        incoming[::3] = mirror[::3] + 0.2 * incoming[::3]
        outgoing, incoming = (
            v / np.linalg.norm(v, axis=1, keepdims=True) for v in (outgoing, incoming)
        )
        near, far = cosine(outgoing, normal), cosine(incoming, normal)
        inputs = {"normal": normal, "outgoing": outgoing, "incoming": incoming}
        clear = np.minimum(np.abs(near), np.abs(far)) > 1e-3
        wish = Wish(inputs | {"transmittance": through}, {"FINISH": ALL}, clear, 32)
        for name, finish in lamps.FINISHES.items():
            yield self._set(
                name, "finishes", "finish", "", wish, parameters={"finish": finish.to_json()}
            )

    # Instances

    def _instances(self) -> Iterator[VectorSet]:
        for name, matrix in TRANSFORMS.items():
            given = {"to_world": matrix.tolist(), "dimmer": 0.5}
            lamp = "compass" if name == "turned" else "wild"
            yield self._set(f"radiance-{name}", "instance", "instance_radiance", lamp,
                            self._placed_surface(lamp, matrix), parameters=given)  # fmt: skip
            yield self._set(f"sample-{name}", "instance", "instance_sample", "wild",
                            self._placed_points("wild", matrix), parameters=given)  # fmt: skip
        for name, matrix in REFUSED.items():
            wish = self._placed_surface("wild", np.eye(4))
            yield VectorSet(
                f"instance/{name}", "instance", "instance_radiance", "wild",
                {k: v[:1] for k, v in wish.float32.items()}, {}, {}, {"REFUSE": [0]},
                {"to_world": matrix.tolist(), "dimmer": 1.0}, REQUIRED,
            )  # fmt: skip

    def _placed_surface(self, lamp: str, matrix: np.ndarray) -> Wish:
        """Points on the placed surface, every other normal on the wrong side."""
        wish = self._wish(lamp, "appearance", 32)
        linear, scale = matrix[:3, :3], np.cbrt(np.linalg.det(matrix[:3, :3]))
        normal, outgoing = (wish.inputs[k] @ linear.T / scale for k in ("normal", "outgoing"))
        wrong = np.arange(len(normal)) % 2 == 1
        inputs = {
            "position": placed(wish.inputs["position"], matrix),
            "normal": np.where(wrong[:, None], -normal, normal),
            "outgoing": outgoing,
        }
        flags = wish.flags | placed_flags(matrix) | {"NORMAL_SIDE": wrong}
        grazing = np.abs((normal * outgoing).sum(1)) < 1e-4  # Here rounding chooses the side.
        return Wish(inputs, flags, ~grazing, 32)

    def _placed_points(self, lamp: str, matrix: np.ndarray) -> Wish:
        wish = self._wish(lamp, "sampler", 32)
        inputs = {"point": placed(wish.inputs["point"], matrix), "u": wish.inputs["u"]}
        flags = {k: v for k, v in placed_flags(matrix).items() if k != "DIMMER"}
        return Wish(inputs, wish.flags | flags, count=32)

    # Composites

    def _composites(self) -> Iterator[VectorSet]:
        turned = TRANSFORMS["scaled"]
        for name, lamp, matrix in (
            ("wild", "wild", np.eye(4)), ("placed", "wild", turned), ("opaque", "paint", np.eye(4)),
            ("black", "black", np.eye(4)), ("compass", "compass", np.eye(4)),
        ):  # fmt: skip
            given = {"to_world": matrix.tolist(), "dimmer": 0.5, "background": BACKGROUND}
            wish = self._rays(lamp, matrix)
            yield self._set(f"view-{name}", "composite", "view", lamp, wish, parameters=given)
        given = {"to_world": turned.tolist(), "dimmer": 0.5, "background": BACKGROUND}
        yield self._set("view-within", "composite", "view", "wild",
                        self._rays("wild", turned, (0.1, 0.5)), parameters=given)  # fmt: skip

    def _rays(self, lamp: str, matrix: np.ndarray, radii: tuple[float, float] = (2.0, 6.0)) -> Wish:
        """Rays at the lamp, every fourth one beside it unless they begin within."""
        rng, sphere = np.random.default_rng(8), lamps.LAMPS[lamp].emission.sphere
        count = 96
        origin = np.array(sphere.center) + sphere.radius * directions(count, rng) * rng.uniform(
            *radii, (count, 1)
        )
        target = np.array(sphere.center) + sphere.radius * 0.5 * rng.uniform(-1, 1, (count, 3))
        direction = target - origin
        direction[::4] = -direction[::4]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        hits = intersect(self._lamps[lamp], origin, direction)
        inward = (hits.normal * direction).sum(1) > 0
        linear = matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3]))
        flags = {
            **placed_flags(matrix),
            "NORMAL_SIDE": hits.valid & inward,
            "BESIDE": ~hits.valid,
            "WITHIN": hits.valid & (radii[1] < 1),
            "DIMMER": hits.valid,
            **self._view_flags(lamp, hits.valid),
        }
        inputs = {"origin": placed(origin, matrix), "direction": direction @ linear.T}
        return Wish(inputs, flags, hits.clear, 48)

    def _view_flags(self, lamp: str, valid: np.ndarray) -> Flags:
        special = {"black": "BLACK", "compass": "AXIS_ORDER", "paint": "CHANNEL_ORDER"}
        flags = {special[lamp]: valid} if lamp in special else {}
        see_through = "transparency" in self._lamps[lamp].models
        return flags | {"ONCE" if see_through else "OPAQUE": valid}

    # Estimators

    def _estimators(self) -> Iterator[VectorSet]:
        for name, lamp, matrix in (
            ("wild", "wild", np.eye(4)), ("placed", "wild", TRANSFORMS["scaled"]),
            ("red", "red", np.eye(4)), ("black", "black", np.eye(4)),
            ("millimetre", "millimetre", np.eye(4)),
        ):  # fmt: skip
            given = {"to_world": matrix.tolist(), "dimmer": 0.5}
            yield self._set(f"sampled-{name}", "estimators", "estimate", lamp,
                            self._shading(lamp, matrix), parameters=given)  # fmt: skip
        for operation, lamp in (("estimate", "wild"), ("map_estimate", "compass")):
            name = operation.replace("_", "-")
            yield self._set(f"{name}-inside", "estimators", operation, lamp,
                            self._unserved(lamp), parameters={"dimmer": 0.5})  # fmt: skip
        yield from self._maps()
        yield self._area()

    @staticmethod
    def _unserved(lamp: str) -> Wish:
        """Points inside the bounding sphere, its centre first: no sample can be drawn there."""
        rng, sphere = np.random.default_rng(14), lamps.LAMPS[lamp].emission.sphere
        count = 16
        reach = np.append(0.0, rng.uniform(0.05, 0.99, count - 1))[:, None]
        point = placed(reach * directions(count, rng), ball(sphere))
        inputs = {"point": point, "normal": directions(count, rng), "u": rng.random((count, 2))}
        return Wish(inputs, {"INSIDE": ALL, "CENTRE": reach[:, 0] == 0}, count=count)

    def _maps(self) -> Iterator[VectorSet]:
        """Means of many samples, because hosts may draw from the map as they like."""
        for name, lamp, flag in (
            ("wild", "wild", "MEASURE"), ("compass", "compass", "MAP_ORDER"),
            ("red", "red", "RED_ONLY"), ("black", "black", "BLACK"),
        ):  # fmt: skip
            yield self._map(name, lamp, flag, np.eye(4))
        yield self._map("placed", "compass", "MAP_ORDER", TRANSFORMS["scaled"])

    def _map(self, name: str, lamp: str, flag: str, matrix: np.ndarray) -> VectorSet:
        """Points that see half of the lamp, each with many samples."""
        rng, sphere = np.random.default_rng(11), lamps.LAMPS[lamp].emission.sphere
        point = placed(directions(6, rng) * np.array([[1.2, 1.5, 2, 4, 8, 50]]).T, ball(sphere))
        point = point.astype(np.float32).astype(np.float64)
        normal = np.cross(cap(point, sphere).axis, directions(6, rng))
        normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32)
        mean, deviation = self._irradiance(self._lamps[lamp], point, normal.astype(np.float64))
        linear = matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3]))
        inputs = {
            "point": np.repeat(placed(point, matrix), SAMPLES, 0),
            "normal": np.repeat(normal @ linear.T, SAMPLES, 0),
            "u": rng.random((len(point) * SAMPLES, 2)),
        }
        flags = [flag, "MEASURE", *placed_flags(matrix)] if flag != "BLACK" else [flag]
        return VectorSet(
            f"estimators/map-{name}", "estimators", "map_estimate", lamp,
            Wish(inputs, {}).float32, {"irradiance": 0.5 * mean},
            {"irradiance": 0.5 * (FLOOR * mean + SIGMAS * deviation / math.sqrt(SAMPLES))},
            {flag: list(range(len(point))) for flag in dict.fromkeys(flags)},
            {"to_world": matrix.tolist(), "dimmer": 0.5}, average=SAMPLES,
        )  # fmt: skip

    @staticmethod
    def _irradiance(lamp: Asset, point: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, ...]:
        """Irradiance by quadrature over the map, and the deviation of Eq. 13's samples: [N, 3]."""
        side = (np.arange(128) + 0.5) / 128
        u = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)  # Eight by eight in each cell.
        cells = lamp("fast_map", np.float64, point=point)["radiance_map"]
        means, deviations = [], []
        for k in range(len(point)):
            view = cap(np.repeat(point[k : k + 1], len(u), 0), lamp.manifest.bounding_sphere)
            light = cells[k].repeat(8, 0).repeat(8, 1).reshape(-1, 3)
            power = light @ LUMINANCE
            cosine = np.maximum(cap_to_direction(u, view) @ normal[k], 0)[:, None]
            share = power[:, None] / max(power.mean(), np.finfo(float).tiny)  # Density on u.
            each = light * cosine * view.solid_angle[:, None]
            square = np.divide(each**2, share, out=np.zeros_like(each), where=share > 0).mean(0)
            means.append(each.mean(0))
            deviations.append(np.sqrt(np.maximum(square - means[-1] ** 2, 0)))
        return np.array(means), np.array(deviations)

    def _shading(self, lamp: str, matrix: np.ndarray) -> Wish:
        """Points outside the bounding sphere, with normals on either side of the horizon."""
        rng, sphere = np.random.default_rng(9), lamps.LAMPS[lamp].emission.sphere
        count = 160
        point = probes.points(sphere, 100.0, count, rng).astype(np.float64)
        u = squares(count, rng)[rng.permutation(count)]
        result = self._lamps[lamp]
        view = cap(point, sphere)
        normal = view.axis + 0.9 * directions(count, rng)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        toward = cap_to_direction(u, view)
        if "sampler" in result.models:
            toward = result("sampler", np.float64, point=point, u=u)["toward"]
        near = np.linalg.norm(point - sphere.center, axis=1) < 5e3 * sphere.radius
        clear = intersect(result, point, toward).clear & view.outside & near
        linear = matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3]))
        flags = {"MEASURE": ALL, **placed_flags(matrix)}
        flags |= {HARD[lamp]: ALL} if lamp in HARD else {}
        flags |= point_flags(point, sphere) | {"U_EDGE": u_edge(u)}
        inputs = {"point": placed(point, matrix), "normal": normal @ linear.T, "u": u}
        return Wish(inputs, flags, clear, 48)

    def _area(self) -> VectorSet:
        rng, surface = np.random.default_rng(10), self._lamps["wild"].surface
        lamp = Extent(surface.positions, surface.triangles[:8], lamps.SPHERE, 15.0)
        inputs = probes.surface_probes(lamp, 64, rng)
        point = probes.points(lamps.SPHERE, 100.0, 64, rng)
        facing = np.abs(cosine(inputs["position"] - point, inputs["normal"]))
        pdf = rng.uniform(0.1, 10, 64)
        wish = Wish(
            {"point": point, "position": inputs["position"], "normal": inputs["normal"],
             "pdf_area": pdf},
            {"MEASURE": ALL, **point_flags(point, lamps.SPHERE)}, facing > 0.01,
        )  # fmt: skip
        return self._set("area", "estimators", "area_to_solid_angle", "", wish)
