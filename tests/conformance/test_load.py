"""Both runtimes compare networks with their golden vectors at load, unless told not to."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.members import container, npy
from purelight_format.members import network as member_of
from purelight_format.networks import golden
from purelight_format.networks.vectors import SIGNATURES
from purelight_mitsuba.lamps import luminaire
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.translate.golden import ReducedPrecisionWarning
from purelight_mitsuba.translate.network import FusedNetwork
from purelight_onnx.luminaire import Luminaire
from tests.support import lamp

FINE = nullcontext()


def write(path: Path, network: str, error: float) -> Path:
    """A bundle one of whose golden outputs is off by 1 + error; all else about it is valid."""
    content = lamp.good()
    member = f"vectors/{network}.{next(iter(SIGNATURES[network].outputs))}.npy"
    outputs = npy.loads(content[member], member, "<f8") * (1 + error)
    path.write_bytes(lamp.seal({**content, member: npy.dumps(outputs)}))
    return path


@pytest.mark.parametrize("network", lamp.NETWORKS)
def test_onnx_runtime_refuses_a_network_that_misses(network: str, tmp_path: Path) -> None:
    Luminaire.open(write(tmp_path / "good.plux", network, 0.0)).network(network)
    wrong = write(tmp_path / "wrong.plux", network, 1e-2)
    with pytest.raises(PureLightError, match=f"{network}: 8 of 8 golden vectors"):
        Luminaire.open(wrong).network(network)
    Luminaire.open(wrong, check_vectors=False).network(network)


@pytest.mark.parametrize("network", lamp.NETWORKS)
def test_mitsuba_refuses_a_network_that_misses(network: str, tmp_path: Path) -> None:
    load(write(tmp_path / "good.plux", network, 0.0)).network(network)
    wrong = load(write(tmp_path / "wrong.plux", network, 1e-2))
    with pytest.raises(PureLightError, match=f"{network}: 8 of 8 golden vectors"):
        wrong.network(network)
    wrong.check_vectors = False
    wrong.network(network)


@pytest.mark.parametrize("network", lamp.NETWORKS)
@pytest.mark.parametrize(("error", "missed"), [(1e-3, False), (-0.3, True)])
def test_half_precision_has_a_bound_too(
    network: str, error: float, missed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(luminaire, "FusedNetwork", partial(FusedNetwork, half=True))
    opened = load(write(tmp_path / "lamp.plux", network, error))
    refused = pytest.raises(PureLightError, match="golden vectors are not met")
    with pytest.warns(ReducedPrecisionWarning, match="its bound"), refused if missed else FINE:
        opened.network(network)


@pytest.mark.parametrize("given", [{}, {"check_vectors": True}, {"check_vectors": False}])
def test_a_scene_says_whether_to_check(given: dict[str, Any], tmp_path: Path) -> None:
    wrong = write(tmp_path / "wrong.plux", "appearance", 1e-2)
    description = {"type": "purelight", "filename": str(wrong), **given}
    scene = mi.load_dict({"type": "scene", "lamp": description})
    integrator = mi.load_dict({"type": "purelight"})
    if given.get("check_vectors", True):
        with pytest.raises(PureLightError, match="golden vectors"):
            integrator.prepare(scene)
    else:
        integrator.prepare(scene)


def test_the_bundles_of_the_suite_carry_vectors(folder: Path) -> None:
    for path in (folder / "bundles").iterdir():
        bundle = Bundle.open(path)
        for network in bundle.manifest.networks:
            assert member_of(network) in container.scan(bundle.data)
            assert len(bundle.vectors(network)) == golden.count(network)
            assert np.isfinite(next(iter(bundle.vectors(network).tolerances.values()))).all()
