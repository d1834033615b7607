"""The paper's `Shell 4D` and `Shell 4D Fact` (its Sec. 4.5): flows on a sphere around the lamp."""

from __future__ import annotations

from pathlib import Path

from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.rivals.neural import BUNDLE, BundleSystem


class Shell4D(BundleSystem):
    """One flow over place and direction on the sphere, distilled into a student there.

    The paper shows the flow itself; to be rendered at all it goes the same way here as our teacher
    does, into a student of the same size with its own sampler. The photons are as many as those of
    the route `teacher`, the steps of the flow those of our directional one.
    """

    name = "shell_4d"
    label = "Shell 4D (the paper's variant): one 4D flow on the bounding sphere, distilled"
    factorised = False

    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Train flow, student, transparency and sampler, export."""
        from benchmarks.systems.rivals import proxy
        from benchmarks.systems.rivals.shell_route import FactorisedRoute, Shell4DRoute
        from purelight_train.runs.trained import SAMPLER, STUDENT, TRANSPARENCY

        route = FactorisedRoute if self.factorised else Shell4DRoute
        preset = proxy.base_preset(subject).for_route("teacher")
        training = proxy.proxy_run(subject, folder / "run", route, preset)
        with account.stage("light"):
            training.lamp.store()
        if not (folder / "run/networks/student.safetensors").is_file():
            with account.stage("teacher"):
                training.route.teacher  # type: ignore[attr-defined] # noqa: B018
        proxy.finish(training, (STUDENT, TRANSPARENCY, SAMPLER), folder / BUNDLE, account)


class ShellFactorised(Shell4D):
    """A flow for the place, and one for the direction given a dense grid over the sphere."""

    name = "shell_4d_factorised"
    label = (
        "Shell 4D Fact (the paper's variant): marginal and conditional flow on the bounding "
        "sphere, distilled"
    )
    factorised = True
