"""Makes the example lamps of the page: python -m web.examples.make.

Their networks are formulas, so that the files are small; nothing in them is measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from purelight_export.graph import Graph, Value
from purelight_format import bundle, members
from purelight_format.measures import BoundingSphere, frame
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.members.surface import Surface
from purelight_format.networks import reference
from purelight_format.networks.golden import golden_vectors
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.probes import Extent
from purelight_format.networks.profile import inspect

FOLDER = Path(__file__).parent
R_MAX = 15.0
DIRECTIONS = 128  # Of each triangle, for its flux.
GLOBE_RADIUS = 0.09
LANTERN_RADIUS, LANTERN_HEIGHT, RIBS = 0.17, 0.36, 12
CORE, HALO, HAZE = (60.0, 43.0, 23.0), (4.0, 2.3, 1.0), (0.5, 0.36, 0.24)
PAPER, BULB = (9.0, 6.0, 3.2), (30.0, 21.0, 11.0)
TINT = (0.97, 0.96, 0.92)


@dataclass(frozen=True)
class Ray:
    """What a network is asked, in radii about the centre.

    Arguments:
        place, outgoing: [N, 3]; height: [N, 1] of the place.
        facing: [N, 1] cosine with the normal.
    """

    graph: Graph
    place: Value
    outgoing: Value
    height: Value
    facing: Value


Formula = Callable[[Ray], Value]


def network(name: str, output: str, radius: float, formula: Formula) -> bytes:
    """A network of the surface from a formula."""
    graph = Graph(name)
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    place = position * (1 / radius)
    facing = graph.sum(normal * outgoing)
    graph.output(
        output, formula(Ray(graph, place, outgoing, graph.slice(place, 2, 3), abs(facing)))
    )
    return graph.to_bytes()


# A globe of clear glass around a glowing rod, hung by a dark cap.


def _rod(ray: Ray) -> tuple[Value, Value]:
    """How much of the rod and of its halo a ray sees, by its point next to the axis: [N, 1]."""
    graph = ray.graph
    nearest = ray.place - graph.sum(ray.place * ray.outgoing) * ray.outgoing
    x, y, z = graph.columns(nearest)
    aside, along = x * x + y * y, z * z
    rod = graph.exp(-(aside * (1 / 0.07**2) + along * along * (1 / 0.34**4)))
    return rod, graph.exp(-(aside + along) * (1 / 0.38**2))


def _cap(ray: Ray, height: Value) -> Value:
    return ray.graph.sigmoid((height - 0.88) * 90.0)


def globe_light(ray: Ray) -> Value:
    rod, halo = _rod(ray)
    limb = 1.0 - ray.facing
    inside = rod * np.array(CORE) + halo * np.array(HALO) + (limb * limb + 0.15) * np.array(HAZE)
    return inside * (1.0 - _cap(ray, ray.height)) + _cap(ray, ray.height) * 0.03


def globe_clear(ray: Ray) -> Value:
    """Fresnel's fall towards the rim, twice; the rod and the cap hide what is behind."""
    graph = ray.graph
    rod, _ = _rod(ray)
    limb = 1.0 - ray.facing
    pane = 1.0 - limb * limb * limb
    far = ray.height - graph.sum(ray.place * ray.outgoing) * graph.slice(ray.outgoing, 2, 3) * 2.0
    caps = (1.0 - _cap(ray, ray.height)) * (1.0 - _cap(ray, far))
    return pane * pane * caps * (1.0 - rod * 0.95) * np.array(TINT)


def globe() -> tuple[Surface, dict[str, bytes], float]:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.999 * GLOBE_RADIUS)
    networks = {
        "appearance": network("appearance", "radiance", GLOBE_RADIUS, globe_light),
        "transparency": network("transparency", "transmittance", GLOBE_RADIUS, globe_clear),
    }
    return _surface(mesh, networks["appearance"]), networks, GLOBE_RADIUS


# A paper lantern with ribs, open below, where one sees its bulb.


def lantern_light(ray: Ray) -> Value:
    graph = ray.graph
    middle = graph.exp(-(ray.height + 0.1) * (ray.height + 0.1) * (1 / 0.62**2))
    rib = graph.cos(ray.height * (2 * math.pi * RIBS / (2 * LANTERN_HEIGHT / _reach())))
    paper = (middle * 0.8 + 0.2) * (rib * 0.16 + 0.84) * (ray.facing * 0.35 + 0.65)
    x, y, _ = graph.columns(ray.place)
    across = (x * x + y * y) * (_reach() / (0.4 * LANTERN_RADIUS)) ** 2
    edge = graph.sigmoid((abs(ray.height) - 0.985 * LANTERN_HEIGHT / _reach()) * 400.0)
    below = graph.sigmoid(ray.height * -50.0)
    bulb = graph.exp(across * -2.0) * below * (ray.facing * ray.facing) * np.array(BULB)
    return paper * (1.0 - edge) * np.array(PAPER) + edge * (bulb + 0.15)


def _reach() -> float:
    return 1.02 * math.hypot(LANTERN_HEIGHT, 0.4 * LANTERN_RADIUS)


def lantern() -> tuple[Surface, dict[str, bytes], float]:
    height = np.linspace(-1, 1, 4 * RIBS + 1)
    bulge = np.sqrt(np.maximum(1 - 0.84 * height**2, 0))
    rib = 1 + 0.022 * np.cos(2 * np.pi * RIBS * (height + 1) / 2)
    profile = np.stack([LANTERN_RADIUS * bulge * rib, LANTERN_HEIGHT * height], 1)
    closed = np.concatenate([[[0, -LANTERN_HEIGHT]], profile, [[0, LANTERN_HEIGHT]]])
    mesh = trimesh.creation.revolve(closed, sections=40)
    appearance = network("appearance", "radiance", _reach(), lantern_light)
    return _surface(mesh, appearance), {"appearance": appearance}, _reach()


# Bundles


def _surface(mesh: trimesh.Trimesh, appearance: bytes) -> Surface:
    """The mesh with the flux of each triangle: Eq. 9 at its middle, both ways if it is open."""
    positions = np.asarray(mesh.vertices, np.float32)
    corner = positions.astype(float)[mesh.faces]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    normal = cross / (2 * area[:, None])
    k = np.arange(DIRECTIONS) + 0.5
    radius, phi = np.sqrt(k / DIRECTIONS), k * math.pi * (3 - math.sqrt(5))
    x, y, z = radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - radius**2)
    flux = np.zeros((len(area), 3))
    tangent, bitangent = frame(normal)
    for a, b, c in zip(x, y, z, strict=True):  # Directions by cosine.
        outgoing = a * tangent + b * bitangent + c * normal
        feed = {"position": corner.mean(1), "normal": normal, "outgoing": outgoing}
        flux += reference.evaluate(appearance, feed)["radiance"]
    flux *= math.pi * area[:, None] / DIRECTIONS
    return Surface(positions, np.asarray(mesh.faces, np.uint32), flux.astype(np.float32))


def write(name: str, surface: Surface, networks: dict[str, bytes], radius: float) -> Path:
    """Writes a bundle with golden vectors."""
    sphere = BoundingSphere((0.0, 0.0, 0.0), radius)
    flux = surface.triangle_flux.astype(float).sum(0)
    scale = float((flux / surface.area().sum() / math.pi).mean())
    content, infos = surface.to_members(), {}
    extent = Extent(surface.positions, surface.triangles, sphere, R_MAX)
    for kind, model in networks.items():
        probes = KINDS[kind].probes(extent, 96, np.random.default_rng(0))
        golden = golden_vectors(kind, model, probes, KINDS[kind].units(scale))
        content |= {members.network(kind): model, **golden.to_members()}
        cost = inspect(model, kind)
        infos[kind] = NetworkInfo(
            members.network(kind), cost.macs_per_sample, cost.floats_per_sample, cost.bytes
        )
    manifest = Manifest(
        name=name, bounding_sphere=sphere, flux=(float(flux[0]), float(flux[1]), float(flux[2])),
        radiance_scale=scale, r_max=R_MAX, channels=(True, True, True), networks=infos,
        provenance={"made by": "web/examples/make.py", "nature": "formulas, not a traced lamp"},
    )  # fmt: skip
    path = FOLDER / f"{name.replace(' ', '_')}.plux"
    bundle.write(path, manifest, content)
    return path


def main() -> None:
    """Writes both lamps."""
    for name, made in (("Glass globe", globe), ("Paper lantern", lantern)):
        path = write(name, *made())
        print(f"{path.name}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
