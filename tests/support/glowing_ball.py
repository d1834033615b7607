"""A luminaire whose networks are short formulas: a ball that glows by the direction of light."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import trimesh

from purelight_export.graph import Graph
from purelight_format.measures import BoundingSphere
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import Vectors

SPHERE = BoundingSphere((0.5, -1.0, 2.0), 0.2)


def appearance() -> bytes:
    """radiance = position - centre + 2 outgoing + 3 normal, so that any mix-up shows."""
    graph = Graph("appearance")
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    offset = position - np.array(SPHERE.center)
    graph.output("radiance", offset + outgoing * 2.0 + normal * 3.0)
    return graph.to_bytes()


def transparency() -> bytes:
    """transmittance = 0.25, 0.5, 0.75."""
    graph = Graph("transparency")
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    graph.output(
        "transmittance", (position + normal + outgoing) * 0.0 + np.array([0.25, 0.5, 0.75])
    )
    return graph.to_bytes()


def sampler() -> bytes:
    """toward = (u, 0, 0), pdf = x of the point."""
    graph = Graph("sampler")
    point, u = graph.input("point", 3), graph.input("u", 2)
    graph.output("toward", graph.concat([u, graph.slice(point, 2, 3)]))
    graph.output("pdf_solid_angle", graph.flatten(graph.slice(point, 0, 1)))
    return graph.to_bytes()


def ball() -> Surface:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=SPHERE.radius)
    positions = (mesh.vertices + np.array(SPHERE.center)).astype(np.float32)
    triangles = mesh.faces.astype(np.uint32)
    return Surface(positions, triangles, np.ones((len(triangles), 3), np.float32))


@dataclass
class FakeBundle:
    """What `Luminaire` uses of a bundle, in memory."""

    networks: dict[str, bytes]
    golden: dict[str, Vectors]
    path: Path = Path("lamp.plux")
    reads: list[str] = field(default_factory=list)

    @property
    def manifest(self) -> SimpleNamespace:
        infos = {
            name: SimpleNamespace(member=f"networks/{name}.onnx", floats_per_sample=100)
            for name in self.networks
        }
        return SimpleNamespace(networks=infos, bounding_sphere=SPHERE)

    def read(self, member: str) -> bytes:
        self.reads.append(member)
        return self.networks[Path(member).stem]

    def vectors(self, network: str) -> Vectors:
        return self.golden[network]

    def surface(self) -> Surface:
        return ball()


def bundle() -> FakeBundle:
    """The ball, with golden vectors of what it shows."""
    inputs = {name: np.eye(3, dtype=np.float32) for name in ("position", "normal", "outgoing")}
    radiance = 6 * np.eye(3) - np.array(SPHERE.center)
    tolerance = np.full((3, 3), 1e-5)
    golden = Vectors("appearance", inputs, {"radiance": radiance}, {"radiance": tolerance})
    constant = np.tile([0.25, 0.5, 0.75], (3, 1))
    through = Vectors(
        "transparency", inputs, {"transmittance": constant}, {"transmittance": tolerance}
    )
    networks = {"appearance": appearance(), "transparency": transparency(), "sampler": sampler()}
    return FakeBundle(networks, {"appearance": golden, "transparency": through})
