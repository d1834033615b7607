"""Making the suite: from the lamps' recipes to a folder."""

from __future__ import annotations

from pathlib import Path

from purelight_conformance import broken, lamps, suite
from purelight_conformance.cases import Cases
from purelight_conformance.suite import Suite, VectorSet
from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.networks.vectors import SIGNATURES


def make(folder: Path) -> Suite:
    """Makes the suite and writes it to a folder; the same version gives the same bytes.

    Raises:
        PureLightError: If the folder cannot be written.
    """
    atomic.check_folder(folder)
    paths = {name: folder / "bundles" / f"{name}.plux" for name in lamps.LAMPS}
    written = {name: lamps.LAMPS[name].write(path) for name, path in paths.items()}
    readable = tuple(broken.put(name, {}, valid=True) for name in paths)
    spoilt = broken.write(written["plain"], folder / "files")
    made = Suite((*Cases(written), *readable), paths) + spoilt
    suite.write(made, folder)
    return made


def of_bundle(bundle: Bundle, title: str = "") -> Suite:
    """The golden vectors of any bundle as part of a suite.

    Arguments:
        title: what its vectors are called after; the stem of the bundle's name if empty.
    """
    name = str(bundle.path)
    sets = []
    for network in (n for n in bundle.manifest.networks if n in SIGNATURES):
        golden = bundle.vectors(network)
        flags = {"GOLDEN": list(range(len(golden)))}
        sets.append(VectorSet(
            f"{title or bundle.path.stem}/{network}", network, network, name, golden.inputs,
            golden.outputs, golden.tolerances, flags,
        ))  # fmt: skip
    return Suite(tuple(sets), {name: bundle.path})
