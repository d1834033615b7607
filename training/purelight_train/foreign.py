"""Lamps for training from files of other formats, and doubts about any lamp."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from purelight_format import command
from purelight_format.errors import PureLightError
from purelight_format.ray_file.files import is_ray_file
from purelight_import.cli import tell
from purelight_import.formats import is_mitsuba_3
from purelight_import.options import Options
from purelight_import.parts.choice import LISTED
from purelight_import.write import folder as folders

if TYPE_CHECKING:
    from purelight_train.light.luminaire import Luminaire

COMMAND = "purelight-train"
FOLDER = "lamp"  # of an imported lamp, in its run


@dataclass(frozen=True)
class LampFile:
    """Arguments:
    scene: a scene of Mitsuba 3.
    look: to be called with the loaded lamp before long work begins.
    """

    scene: Path
    look: Callable[[Any], None]


@contextmanager
def scene_of(path: Path, run: Path, options: Options) -> Iterator[LampFile]:
    """The Mitsuba scene of a lamp: the file itself, or an import of it in the run's folder.

    What was imported is taken away again if the block fails before the run has begun.

    Raises:
        PureLightError: the file cannot be taken, or the run is of another lamp.
    """
    if is_ray_file(path):
        if options.given:
            raise PureLightError(f"{path}: rays have no parts; leave out what chooses them")
        yield LampFile(path, _ignore)
        return
    if not options.given and is_mitsuba_3(path):
        yield LampFile(path, _look)
        return
    folder = run / FOLDER
    fresh = not folder.exists()
    missing = [parent for parent in folder.parents if not parent.exists()]
    scene = _imported(path, folder, options)
    try:
        yield LampFile(scene, _ignore if options.keep else _hint_at)
    except BaseException:
        if fresh and not (run / "config.json").is_file():
            shutil.rmtree(folder, ignore_errors=True)
            for parent in missing:
                with suppress(OSError):
                    parent.rmdir()
        raise


def _imported(path: Path, folder: Path, options: Options) -> Path:
    """The scene of an import, made now or when the run began."""
    from purelight_import.importing import digest, import_lamp

    record = folders.read_record(folder)
    if record is None:
        made = import_lamp(path, folder, options, picture=False, away=_away)
        tell(COMMAND, made.notes, made.doubts)
        return made.scene
    same = record.get("options") == options.to_dict() and path.is_file()
    if not same or record.get("source_digest") != digest(path):
        raise PureLightError(
            f"{folder.parent}: was made from another lamp, or with other options about it; choose "
            "another --output"
        )
    return folder / str(record["scene"])


def _ignore(_: Any) -> None:
    """Of an imported lamp all has been said."""


def _look(lamp: Luminaire) -> None:
    _warn_of(lamp)
    _hint_at(lamp)


def _warn_of(lamp: Luminaire) -> None:
    """Prints what seems wrong with a lamp; `lamp` itself has warned of glass inside out."""
    from purelight_import.sanity import doubts

    for line in doubts(lamp.scene):
        if "inside out" not in line:
            command.warn(COMMAND, line)


def _away(scene: Path) -> list[str]:
    """What `--keep auto` means."""
    from purelight_mitsuba.scene_file import load_scene
    from purelight_train.light.kept import parts_away

    return parts_away(load_scene(scene, optimize=False))


def _hint_at(lamp: Luminaire) -> None:
    """Says what `--keep auto` would keep; a lamp of which that is nothing says nothing."""
    from purelight_train.light.kept import parts_away

    found = parts_away(lamp.scene)
    if found:
        more = f" and {len(found) - LISTED} more" if len(found) > LISTED else ""
        command.note(
            COMMAND,
            f"{', '.join(found[:LISTED])}{more}: opaque and away from the light; "
            "--keep auto leaves such parts out of the networks, as geometry of the room",
        )
