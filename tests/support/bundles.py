"""A bundle of any surface and any networks: what every lamp that the tests make is written with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from purelight_format import members
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.members.surface import Surface
from purelight_format.networks import reference
from purelight_format.networks.profile import inspect
from purelight_format.networks.vectors import Vectors

Members = dict[str, bytes]
Parts = tuple[Manifest, Members]
Allowed = Callable[[np.ndarray], np.ndarray]


def parts(surface: Surface, golden: Mapping[str, tuple[bytes, Vectors]], **about: Any) -> Parts:
    """A manifest and members for `bundle.write`.

    Arguments:
        golden: ONNX and golden vectors by network.
        about: the manifest's other fields.
    """
    return with_networks((Manifest(networks={}, **about), surface.to_members()), golden)


def with_networks(given: Parts, golden: Mapping[str, tuple[bytes, Vectors]]) -> Parts:
    """The same with networks added or replaced."""
    manifest, content = given[0], dict(given[1])
    infos = dict(manifest.networks)
    for name, (model, vectors) in golden.items():
        content |= {members.network(name): model, **vectors.to_members()}
        infos[name] = info(name, model)
    return replace(manifest, networks=infos), content


def info(network: str, model: bytes) -> NetworkInfo:
    """What the manifest says of a network."""
    cost = inspect(model, network)
    fraction = 0.05 if network == "sampler" else None
    member = members.network(network)
    return NetworkInfo(member, cost.macs_per_sample, cost.floats_per_sample, cost.bytes, fraction)


def vectors(
    network: str, model: bytes, inputs: Mapping[str, np.ndarray], allowed: Allowed
) -> Vectors:
    """Golden vectors by the reference evaluator, and what a host `allowed` may be off by."""
    outputs = reference.evaluate(model, inputs)
    return Vectors(network, inputs, outputs, {k: allowed(y) for k, y in outputs.items()})
