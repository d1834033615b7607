"""The system `wcl`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem
from purelight_format import atomic
from purelight_format.bundle import Bundle

if TYPE_CHECKING:  # they need Mitsuba's variant
    from benchmarks.systems.rivals.wcl.bins import Bins, Box
    from purelight_train.light.exit_records import ExitRecords
    from purelight_train.runs.pipeline import Training

LAYOUTS = ((8, 32), (16, 16), (16, 32))  # bins along a side of a face, and of the hemisphere
SIGMAS = (0.0, 0.5, 1.0)  # of the filter, in bins
SEEN = 1 << 14  # held-out photons that choose among them
UNTRAINED = {"losses": [], "seconds": 0.0, "skipped": 0}  # What a run says of such a network


class Wcl(BundleSystem):
    """Light-traced photons in 4D bins on the faces of a box, filtered, and wavelet-compressed.

    No public code exists, and of the paper only what its abstract and others tell is known to us.
    As there: bins over place and direction on a box, a Gaussian filter in four dimensions, wavelets
    under a budget of bytes, illumination only. Ours: of `LAYOUTS` and `SIGMAS` those are taken that
    held-out photons like best; Haar wavelets, the largest coefficients kept; the stochastic filter
    at rendering is replaced by its mean, linear interpolation; directions towards the lamp are
    drawn by our flow sampler, trained on this light, in place of viewpoint samplers refined by
    wavelets. The photons are as many paths as those of our route `teacher`, the budget is the size
    of our appearance network. Megabytes are those after compression, with the other networks.
    """

    name = "wcl"
    label = (
        "WCL (Atanasov & Koylazov 2025), re-implemented by us from its abstract, no public code: "
        "4D bins on a box, filter, wavelets in the bytes of our appearance network"
    )
    answers = ("illumination",)

    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Trace and count the light, compress it, train what aims at it, write the bundle."""
        from benchmarks.systems.rivals import proxy
        from benchmarks.systems.rivals.rebundle import with_networks
        from benchmarks.systems.rivals.wcl.bins import Box
        from benchmarks.systems.rivals.wcl.table import Table, appearance
        from benchmarks.systems.rivals.wcl.wavelets import compress
        from purelight_train.networks.student import Student
        from purelight_train.runs.routes import TeacherRoute
        from purelight_train.runs.trained import SAMPLER, TRANSPARENCY

        preset = proxy.base_preset(subject).for_route("teacher")
        training = proxy.proxy_run(
            subject, folder / "run", TeacherRoute, preset, lambda s: Box.around(s).mesh()
        )
        run = training.stages.run
        with account.stage("light"):
            training.lamp.store()
            records = training.lamp.records
        box = Box.of(training.lamp.surface)
        with account.stage("bins"):
            chosen, layout = best(box, records, training)
            packed = compress(chosen, budget(subject))
            atomic.write_bytes(folder / "table.wcl", packed.data)
            about = {"layout": layout, "kept": packed.kept, "table_bytes": len(packed.data)}
            atomic.write_bytes(folder / "table.json", json.dumps(about).encode())
        model = appearance(packed.bins)
        training.adopt("student", Table(model))
        # The exporter wants a student; an untrained one is replaced at once
        run.save("student", Student(training.lamp.description, preset), UNTRAINED)
        proxy.finish(training, (TRANSPARENCY, SAMPLER), folder / "frame.plux", account)
        with_networks(folder / "frame.plux", folder / BUNDLE, {"appearance": model})

    def held(self, file: Path) -> float:
        """Of the file, with the compressed table in place of the plain one."""
        about = json.loads((file.parent / "table.json").read_text())
        infos = Bundle.open(file, validate=False).manifest.networks
        plain = infos["appearance"].bytes
        return super().held(file) + (about["table_bytes"] - plain) / 1e6

    def about(self, folder: Path) -> dict[str, Any]:
        """The layout, and how much of it was kept."""
        told: dict[str, Any] = json.loads((folder / "table.json").read_text())
        return told


def budget(subject: Subject) -> int:
    """Bytes of our appearance network."""
    return Bundle.open(subject.bundle, validate=False).manifest.networks["appearance"].bytes


def best(box: Box, records: ExitRecords, training: Training) -> tuple[Bins, dict[str, Any]]:
    """The bins under which held-out photons are likeliest, and what they are."""
    from benchmarks.systems.rivals.wcl.bins import Bins
    from benchmarks.systems.rivals.wcl.table import Table, appearance
    from purelight_train.runs.evaluation import as_function, gain

    lamp = training.lamp
    flux, unseen = np.asarray(lamp.description.flux), lamp.held_out.take(slice(SEEN))
    found: tuple[float, Bins, dict[str, Any]] | None = None
    for places, directions in LAYOUTS:
        counted = Bins.of(box, records, places, directions)
        for sigma in SIGMAS:
            bins = counted.filtered(sigma)
            radiance = as_function(Table(appearance(bins)), training.stages.device)
            nats = gain(radiance, lamp.surface, unseen, flux)
            if found is None or nats > found[0]:
                about = {"places": places, "directions": directions, "sigma": sigma, "nats": nats}
                found = nats, bins, about
    assert found is not None
    return found[1], found[2]
