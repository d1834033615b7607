"""A bundle as programs of the intermediate form, with the constants of all of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from purelight_format import members
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere
from purelight_format.networks.kinds import KINDS, Input
from purelight_format.networks.vectors import SIGNATURES, Vectors
from purelight_shader.form.statements import Program
from purelight_shader.form.store import Store
from purelight_shader.lowering.network import lower

FUNCTIONS = {"sampler": "sample"}  # Others are called by the one thing that they answer.
ROOM = 4.0  # Radii about the centre in which points of the exit surface are expected.
LENGTH = 2.0  # Of vectors that are of length one.
FAR = 3e38


@dataclass(frozen=True)
class Translation:
    """The networks of a bundle.

    Arguments:
        bundle: where they come from, and everything else that is known of the lamp.
        programs: by kind, in the order of the format.
        store: their constants.
    """

    bundle: Bundle
    programs: dict[str, Program]
    store: Store


def translate(bundle: Bundle, store: Store, networks: Collection[str] = KINDS) -> Translation:
    """Translates every network of a valid bundle that the format knows.

    Arguments:
        store: takes their constants.
        networks: other ones are left out.

    Raises:
        PureLightError: If a network has no translation.
    """
    programs = {}
    for network in KINDS:
        if network not in bundle.manifest.networks or network not in networks:
            continue
        model = bundle.read(members.network(network))
        bounds = limits(network, bundle.manifest.bounding_sphere, bundle.vectors(network))
        programs[network] = lower(model, network, SIGNATURES[network], bounds, store)
    return Translation(bundle, programs, store)


def function(network: str) -> str:
    """What the function of a network is called, without the lamp's prefix."""
    return FUNCTIONS.get(network, next(iter(KINDS[network].outputs)))


def limits(
    network: str, sphere: BoundingSphere, vectors: Vectors
) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
    """Between which numbers the inputs of a network lie: what the format says, with room to spare.

    Golden vectors may go further, and then count too. What lies beyond still has an answer; only
    integers computed from it may be cut off.
    """
    found = {}
    for name, given in KINDS[network].inputs.items():
        low, high = _expected(name, given, sphere)
        rows = vectors.inputs[name].astype(np.float64)
        found[name] = np.minimum(low, rows.min(0)), np.maximum(high, rows.max(0))
    return found


def _expected(name: str, given: Input, sphere: BoundingSphere) -> tuple[np.ndarray, np.ndarray]:
    if given.unit or given.square:
        return np.full(given.shape, -LENGTH), np.full(given.shape, LENGTH)
    if name == "position":
        centre = np.asarray(sphere.center, np.float64)
        return centre - ROOM * sphere.radius, centre + ROOM * sphere.radius
    return np.full(given.shape, -FAR), np.full(given.shape, FAR)
