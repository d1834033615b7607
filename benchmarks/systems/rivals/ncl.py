"""Neural Complex Luminaires (Zhu et al. 2021), re-implemented by us from the paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem

FEW = 1 << 20  # paths of light for the sphere and the scale; the networks do not learn them


class Ncl(BundleSystem):
    """A light field on a sphere around the lamp, its transparency, and 16x16 maps of it.

    By the paper, without its authors' code: a proxy sphere; one network for radiance on it, one for
    what is seen through it; an L2 loss in log(1 + x); 16x16 maps by which the scene is lit (our
    fast mode). Where we differ in its favour: networks of our sizes and with our grid encodings;
    maps over the spherical cap instead of a perspective camera, which it fills; their cells sum to
    the right light. To its disfavour: its authors' targets are by bidirectional path tracing, which
    Mitsuba 3 has not; ours are by path tracing, which finds a filament behind glass only by chance.
    `NclLightTraced` has targets better than either: what the two have in common is the method's.

    The targets are as many paths as (1/8 of our distillation's rays) x 256.
    """

    name = "ncl"
    label = (
        "NCL (Zhu et al. 2021), re-implemented by us from the paper, without its authors' code: "
        "light field on a sphere, 16x16 maps; targets by path tracing, theirs are bidirectional"
    )
    mode = "fast"
    light_traced = False

    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Render targets, train the networks, export."""
        from benchmarks.systems.rivals import proxy
        from benchmarks.systems.rivals.path_traced import PathTracedRoute
        from purelight_train.runs.routes import PhotonRoute
        from purelight_train.runs.trained import FAST_MAP, STUDENT, TRANSPARENCY

        preset = proxy.base_preset(subject)
        if self.light_traced:
            chosen = preset.for_route("photons")
            training = proxy.proxy_run(subject, folder / "run", PhotonRoute, chosen)
        else:
            chosen = replace(preset.for_route("teacher"), paths=FEW)
            training = proxy.proxy_run(subject, folder / "run", PathTracedRoute, chosen)
        with account.stage("light"):
            training.lamp.store()
        proxy.finish(training, (STUDENT, TRANSPARENCY, FAST_MAP), folder / BUNDLE, account)


class NclLightTraced(Ncl):
    """The same representation fitted to light-traced photons, as our own students are.

    It tells what of the error is the sphere's and what is the path tracer's. Its flux is closed.
    """

    name = "ncl_light_traced"
    label = (
        "NCL's representation (sphere, 16x16 maps), fitted by us to the photons that our own "
        "networks learn from"
    )
    light_traced = True
