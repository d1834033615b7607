"""The suite's own lamps: small bundles made by code, each for some way to be wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from purelight_conformance import networks
from purelight_conformance.networks import Emission
from purelight_format import bundle, members
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere, frame
from purelight_format.members.finishes import NONE, Finish
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.members.surface import Surface
from purelight_format.networks.golden import golden_vectors
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.probes import Extent
from purelight_format.networks.profile import inspect

CANDIDATES = 256
SCALE = 7.0


@dataclass(frozen=True)
class Lamp:
    """A lamp of the suite.

    Arguments:
        make: the networks from what they are made of.
        emission: sphere, radiance and seed.
        keep: the networks that the bundle carries; all if empty.
        finishes: what it is made of, in turn from triangle to triangle; nothing is said if empty.
    """

    make: Callable[[Emission], Mapping[str, bytes]]
    emission: Emission
    keep: tuple[str, ...] = ()
    finishes: tuple[Finish, ...] = ()

    def write(self, path: Path) -> Bundle:
        """Writes the lamp as a valid bundle."""
        emission, surface = self.emission, octahedron(self.emission.sphere)
        red, green, blue = (level > 0 for level in emission.scale)
        unit = max(emission.scale) or 1.0
        flux = np.array(emission.scale) * math.pi * surface.area().sum()
        share = surface.area()[:, None] / surface.area().sum() * flux
        surface = Surface(
            surface.positions, surface.triangles, share.astype(np.float32), self._sides(surface)
        )
        infos, content = {}, surface.to_members()
        for name, model in self.make(emission).items():
            if self.keep and name not in self.keep:
                continue
            infos[name], content[members.network(name)] = _info(name, model), model
            content |= self._golden(name, model, surface, unit)
        sphere = emission.sphere
        manifest = Manifest(
            path.stem, sphere, _triple(flux), unit, emission.r_max, (red, green, blue), infos,
            provenance={"made_by": "purelight-conformance"}, finishes=self.finishes,
        )  # fmt: skip
        return bundle.write(path, manifest, content)

    def _sides(self, surface: Surface) -> np.ndarray | None:
        """A finish for each side of each triangle, and none for the last."""
        count = len(self.finishes)
        if not count:
            return None
        sides = np.arange(2 * len(surface.triangles)).reshape(-1, 2) % count
        sides[-1] = NONE
        return sides.astype(np.uint8)

    def _golden(
        self, network: str, model: bytes, surface: Surface, unit: float
    ) -> dict[str, bytes]:
        candidates = probe(network, self.emission, surface, CANDIDATES, seed=3)
        units = KINDS[network].units(unit)
        return golden_vectors(network, model, candidates, units).to_members()


def probe(
    network: str, emission: Emission, surface: Surface, count: int, seed: int
) -> dict[str, np.ndarray]:
    """Inputs of a network, the hard cases first."""
    extent = Extent(surface.positions, surface.triangles, emission.sphere, emission.r_max)
    return KINDS[network].probes(extent, count, np.random.default_rng(seed))


def octahedron(sphere: BoundingSphere) -> Surface:
    """A tilted octahedron that fills the sphere, every other triangle turned inside out.

    One triangle comes twice, the second time turned over, and one has no area.
    """
    axis = np.array([[0.48, -0.6, 0.64]])
    axes = np.concatenate((axis, *frame(axis)))
    corners = np.concatenate((axes, -axes)) * 0.99 * sphere.radius + sphere.center
    triangles = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    turned = [t if k % 2 else t[::-1] for k, t in enumerate(triangles)]
    array = np.array([*turned, turned[0][::-1], (0, 0, 1)], np.uint32)
    return Surface(corners.astype(np.float32), array, np.zeros((len(array), 3), np.float32))


def _info(network: str, model: bytes) -> NetworkInfo:
    cost = inspect(model, network)
    fraction = networks.UNIFORM_FRACTION**2 if network == "sampler" else None
    return NetworkInfo(
        members.network(network), cost.macs_per_sample, cost.floats_per_sample, cost.bytes, fraction
    )


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    red, green, blue = map(float, values)
    return red, green, blue


def _scaled(power: float, *mask: float) -> tuple[float, float, float]:
    return _triple(SCALE * power * np.array(mask or (1.0, 0.8, 0.5)))


SPHERE = BoundingSphere((0.25, -0.1875, 0.125), 0.25)
SMALL = BoundingSphere((0.0, 0.0, 0.0), 0.001)  # At the origin, its centre can be met exactly.
LARGE = BoundingSphere((300.0, -200.0, 100.0), 1000.0)
NO_MAP = ("appearance", "transparency", "sampler", "sampler_pdf")

FINISHES = {
    "matt": Finish("matt", (0.7, 0.5, 0.2), ior=1.0),
    "plastic": Finish("plastic", (0.1, 0.4, 0.8), roughness=0.0, specular_color=(0.8, 0.9, 1.0)),
    "satin": Finish("satin", (0.6, 0.6, 0.5), roughness=0.6, ior=1.8),
    "mirror": Finish("mirror", (0.9, 0.8, 0.7), metalness=1.0, roughness=0.01),
    "copper": Finish(
        "copper", (0.95, 0.64, 0.54), metalness=1.0, roughness=0.45, specular_color=(1.0, 0.9, 0.8)
    ),
    "patina": Finish("patina", (0.6, 0.5, 0.3), metalness=0.4, roughness=0.5, ior=1.3),
    "pane": Finish("pane", (0.0, 0.0, 0.0), roughness=0.0, opacity=0.0, thin_walled=True),
    "frost": Finish(
        "frost", (0.1, 0.12, 0.14), roughness=0.6, opacity=0.2, smooth=True, spread=0.9,
        spread_exponent=2.5, diffuse_transmission=(0.05, 0.1, 0.15),
    ),
}  # fmt: skip
LAMPS = {
    "wild": Lamp(networks.wild, Emission(SPHERE, _scaled(1.0))),
    "compass": Lamp(networks.compass, Emission(SPHERE, _scaled(1.0, 1, 1, 1))),
    "paint": Lamp(networks.paint, Emission(SPHERE, (3.0, 2.0, 1.0))),
    "plain": Lamp(networks.compass, Emission(SPHERE, _scaled(1.0)), ("appearance",)),
    "finished": Lamp(
        networks.compass, Emission(SPHERE, _scaled(1.0)), ("appearance",), tuple(FINISHES.values())
    ),
    "red": Lamp(networks.wild, Emission(SPHERE, _scaled(1.0, 1, 0, 0))),
    "black": Lamp(networks.wild, Emission(SPHERE, _scaled(0.0))),
    "faint": Lamp(networks.wild, Emission(SPHERE, _scaled(1e-6)), NO_MAP),
    "bright": Lamp(networks.wild, Emission(SPHERE, _scaled(1e6)), NO_MAP),
    "millimetre": Lamp(networks.wild, Emission(SMALL, _scaled(1.0)), NO_MAP),
    "kilometre": Lamp(networks.wild, Emission(LARGE, _scaled(1.0)), NO_MAP),
}
