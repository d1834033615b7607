"""Rivals that are bundles: what they share is training, export, and our own integrator."""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Any

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Cost, Subject
from benchmarks.systems.rivals.accounts import Account
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp

BUNDLE = "lamp.plux"


class BundleSystem(MitsubaSystem):
    """A system that is trained into a bundle, and rendered by the integrator `purelight`.

    Arguments:
        mode: `accurate`, or `fast` to light the scene by 16x16 maps.
    """

    mode = "accurate"

    @abstractmethod
    def make(self, subject: Subject, folder: Path, account: Account) -> None:
        """Write the bundle into the folder, going on with what an earlier call left.

        Mitsuba has its variant.
        """

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Train and export, unless that is done."""
        account, file = Account(folder), folder / BUNDLE
        if not file.is_file():
            from purelight_mitsuba.platform import use

            use()
            self.make(subject, folder, account)
        return Cost(account.total, self.held(file), {**account.parts, **self.about(folder)})

    def held(self, file: Path) -> float:
        """Megabytes of the whole file, as our own is counted."""
        return file.stat().st_size / 1e6

    def about(self, folder: Path) -> dict[str, Any]:
        """What else should be told."""
        return {}

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The bundle."""
        return NeuralLamp(folder / BUNDLE, self.mode)
