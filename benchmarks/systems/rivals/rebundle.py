"""A bundle with some of its networks replaced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from purelight_format import bundle
from purelight_format.members import MANIFEST
from purelight_format.members.manifest import NetworkInfo
from purelight_format.networks.golden import golden_vectors
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.probes import Extent
from purelight_format.networks.profile import inspect

PROBES = 512


def with_networks(source: Path, output: Path, models: Mapping[str, bytes]) -> bundle.Bundle:
    """Write a bundle that is another but for some networks, by name, and what it says of them.

    Raises:
        PureLightError: it would not be valid.
    """
    old = bundle.Bundle.open(source)
    about, surface = old.manifest, old.surface()
    members = {
        name: old.read(name)
        for name in old.entries if name != MANIFEST and not name.endswith(".usda")
    }  # fmt: skip
    sphere, rng = about.bounding_sphere, np.random.default_rng(0)
    extent = Extent(surface.positions, surface.triangles, sphere, about.r_max)
    infos = dict(about.networks)
    for name, model in models.items():
        kind, cost, member = KINDS[name], inspect(model, name), f"networks/{name}.onnx"
        vectors = golden_vectors(
            name, model, kind.probes(extent, PROBES, rng), kind.units(about.radiance_scale)
        )
        members |= {member: model, **vectors.to_members()}
        fraction = infos[name].uniform_fraction if name in infos else None
        infos[name] = NetworkInfo(
            member, cost.macs_per_sample, cost.floats_per_sample, len(model), fraction
        )
    fidelity = {k: v for k, v in about.fidelity.items() if k != "verdict"}
    manifest = replace(about, networks=infos, fidelity=fidelity, tier=None)
    return bundle.write(output, manifest, members)
