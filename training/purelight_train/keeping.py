"""`--keep`: parts of a lamp that stay ordinary geometry, chosen by name or found."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from purelight_format import command
from purelight_format.errors import PureLightError
from purelight_format.ray_file.files import is_ray_file
from purelight_train.foreign import COMMAND, LampFile
from purelight_train.split import part_names, split

if TYPE_CHECKING:
    from purelight_train.light.luminaire import Luminaire

AUTO = "auto"
FOLDER = "split"  # of a lamp without its kept parts, in its run
MOST_NAMES = 8  # in a line


@contextmanager
def apart(lamp: LampFile, names: Sequence[str], run: Path) -> Iterator[LampFile]:
    """The lamp without the parts that are kept, in the run's folder.

    It is taken away again if the block fails before the run has begun. A lamp of which nothing is
    to be kept is itself, and once it is loaded a line says of what parts `auto` would find.

    Arguments:
        names: of parts; `AUTO` stands for those that `kept.parts_away` finds.

    Raises:
        PureLightError: a part cannot be kept, or the run is of another lamp.
    """
    if not names:
        yield replace(lamp, look=lambda loaded: _look(lamp, loaded))
        return
    if is_ray_file(lamp.scene):
        raise PureLightError(f"{lamp.scene}: rays have no parts; leave out --keep")
    chosen = _chosen(lamp.scene, names)
    if not chosen:
        yield lamp
        return
    folder = run / FOLDER
    fresh = not folder.exists()
    missing = [parent for parent in folder.parents if not parent.exists()]
    scene = split(lamp.scene, chosen, folder)
    try:
        yield replace(lamp, scene=scene)
    except BaseException:
        if fresh and not (run / "config.json").is_file():
            shutil.rmtree(folder, ignore_errors=True)
            for parent in missing:
                with suppress(OSError):
                    parent.rmdir()
        raise


def _chosen(scene: Path, names: Sequence[str]) -> list[str]:
    """The parts to keep; which of them were found is printed."""
    chosen = {name for name in names if name != AUTO}
    if AUTO in names:
        found = _away(scene)
        if found:
            print(f"--keep auto: {_listed(found)}: opaque and away from the light, kept as "
                  "geometry beside the networks")  # fmt: skip
        else:
            command.warn(COMMAND, "--keep auto: no opaque part is away from the light; none is "
                         "kept")  # fmt: skip
        chosen |= set(found)
    return sorted(chosen)


def _away(path: Path) -> list[str]:
    import mitsuba as mi

    from purelight_train.light.kept import parts_away

    named = set(part_names(path))
    if not named:
        return []
    try:
        scene = mi.load_file(str(path.resolve()), optimize=False)
    except RuntimeError as error:
        raise PureLightError(f"{path}: {' '.join(str(error).split())[-300:]}") from None
    return [name for name in parts_away(scene) if name in named]


def _look(lamp: LampFile, loaded: Luminaire) -> None:
    """Says what could be kept; a lamp of which nothing could says nothing."""
    from purelight_train.light.kept import parts_away

    lamp.look(loaded)
    if is_ray_file(lamp.scene):
        return
    named = set(part_names(lamp.scene))
    found = [name for name in parts_away(loaded.scene) if name in named] if named else []
    if found:
        print(f"{_listed(found)}: opaque and away from the light; --keep auto would leave them "
              "out of the networks, as ordinary geometry")  # fmt: skip


def _listed(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
