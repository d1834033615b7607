"""Files that a scene file names: only what lies in its folder is read."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model.notes import Notes


def beside(folder: Path, name: str, *, quoted: bool = False) -> Path:
    """The path of a file that a scene file in a folder names; backslashes are slashes.

    Arguments:
        quoted: whether the name is a URI.

    Raises:
        PureLightError: the file would lie outside the folder, or is none.
    """
    text = (unquote(name) if quoted else name).replace("\\", "/").strip()
    if quoted and "://" in text:
        raise PureLightError(f"{_short(name)}: not fetched from a network; put it beside the file")
    root = folder.resolve()
    try:
        path = (root / PurePosixPath(text)).resolve()
    except (OSError, ValueError, RuntimeError):
        raise PureLightError(f"{_short(name)}: no file can have that name") from None
    if not path.is_relative_to(root):
        raise PureLightError(f"{_short(name)}: lies outside the lamp's folder, and is not read")
    if not files.is_file(path):
        raise PureLightError(f"{_short(name)}: no such file beside the lamp's")
    return path


def gathered(folder: Path, name: str, notes: Notes) -> Path:
    """The same; of a name on its maker's disk, the longest end that the folder has, which is noted.

    Exporters of OBJ write whole paths, and who passes a lamp on puts its pictures beside it.

    Raises:
        PureLightError: the folder has no such file.
    """
    try:
        return beside(folder, name)
    except PureLightError as error:
        parts = PurePosixPath(name.replace("\\", "/")).parts
        for first in range(1, len(parts)):
            with suppress(PureLightError):
                path = beside(folder, "/".join(parts[first:]))
                notes("files of other folders are taken from the lamp's own", path.name)
                return path
        raise error


def _short(name: str) -> str:
    return name if len(name) <= 100 else f"{name[:97]}..."
