"""The lamps and rooms that are wanted, made one by one, and what is shown of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from purelight_examples.gallery import page, sheet
from purelight_examples.gallery.runner import Outcome, Task, line
from purelight_examples.gallery.settings import Settings
from purelight_examples.gallery.shown import LampShown, RoomShown
from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.scenes.interiors import INTERIORS
from purelight_format.errors import PureLightError

BAR = "{desc} {n}/{total} |{bar:20}| {elapsed}"


@dataclass(frozen=True)
class Gallery:
    """What to make, and where.

    Arguments:
        folder: receives a folder for each lamp, `rooms`, `sheet.png` and `gallery.html`.
        rooms: all of whose lamps are among `lamps`.
    """

    folder: Path
    lamps: tuple[str, ...]
    rooms: tuple[str, ...]
    settings: Settings

    @staticmethod
    def of(
        folder: Path, lamps: Sequence[str] | None, rooms: Sequence[str] | None, settings: Settings
    ) -> Gallery:
        """The gallery of some lamps, all by default, and of the rooms that need no other.

        Raises:
            PureLightError: a name is unknown, or a room that was asked for needs another lamp.
        """
        wanted = tuple(lamps) if lamps is not None else tuple(CATALOG)
        _check("lamp", wanted, tuple(CATALOG))
        _check("room", tuple(rooms or ()), tuple(INTERIORS))
        lit = {name: set(room.places()) for name, room in INTERIORS.items()}
        if rooms is None:
            return Gallery(
                folder, wanted, tuple(n for n, need in lit.items() if need <= set(wanted)), settings
            )
        for room in rooms:
            if missing := sorted(lit[room] - set(wanted)):
                raise PureLightError(f"{room} needs {', '.join(missing)}; add it to --lamps")
        return Gallery(folder, wanted, tuple(rooms), settings)

    @property
    def page(self) -> Path:
        """The page with all pictures."""
        return self.folder / "gallery.html"

    def description(self) -> list[str]:
        """A line for each lamp and room."""
        lamps = [f"{n:<16} {_first(CATALOG[n].lamp.__doc__)}" for n in self.lamps]
        rooms = [f"{n:<16} {_first(INTERIORS[n].__doc__)} ({', '.join(INTERIORS[n].places())})"
                 for n in self.rooms]  # fmt: skip
        return ["Lamps", *lamps, "", "Rooms", *rooms]

    def __call__(self) -> list[Outcome]:
        """Make all that is not done, then the sheet and the page; returns what failed."""
        self.folder.mkdir(parents=True, exist_ok=True)
        tasks = [Task("lamp", n, self.folder / n, self.folder, self.settings) for n in self.lamps]
        tasks += [
            Task("room", n, self.folder / "rooms" / n, self.folder, self.settings)
            for n in self.rooms
        ]
        failed: list[Outcome] = []
        with tqdm(total=len(tasks), bar_format=BAR, disable=None) as bar:  # no bar in a log
            for number, task in enumerate(tasks, 1):
                outcome = self._blocked(task, failed) or task(bar)
                failed += [outcome] if outcome.fault else []
                tqdm.write(f"[{number}/{len(tasks)}] {line(outcome, self._figures(outcome))}")
                bar.update()
            bar.set_description_str("the sheet and the page")
            self._show(failed)
        return failed

    def _blocked(self, task: Task, failed: list[Outcome]) -> Outcome | None:
        """The outcome of a room one of whose lamps failed."""
        if task.kind == "lamp":
            return None
        needed = set(INTERIORS[task.name].places())
        missing = [o.name for o in failed if o.kind == "lamp" and o.name in needed]
        return Outcome("room", task.name, 0.0, f"no {', '.join(missing)}") if missing else None

    def _figures(self, outcome: Outcome) -> str:
        if outcome.kind == "room" or outcome.fault:
            return ""
        return LampShown(self.folder, outcome.name).line()

    def _show(self, failed: list[Outcome]) -> None:
        bad = {outcome.name for outcome in failed}
        lamps = [LampShown(self.folder, name) for name in self.lamps if name not in bad]
        rooms = [RoomShown(self.folder, name) for name in self.rooms if name not in bad]
        if lamps:
            sheet.write(self.folder / "sheet.png", lamps)
        page.write(self.page, lamps, rooms, [line(outcome) for outcome in failed])


def _check(kind: str, names: tuple[str, ...], known: tuple[str, ...]) -> None:
    if unknown := [name for name in names if name not in known]:
        raise PureLightError(f"no {kind} is called {unknown[0]}; there are {', '.join(known)}")
    if len(set(names)) < len(names):
        raise PureLightError(f"a {kind} is named twice")


def _first(text: str | None) -> str:
    """The first sentence of a docstring."""
    words = " ".join((text or "").split())
    return words.split(". ")[0].rstrip(".")
