"""Files that a scene file names: only what lies in its folder is read."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from purelight_format import files
from purelight_format.errors import PureLightError


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


def _short(name: str) -> str:
    return name if len(name) <= 100 else f"{name[:97]}..."
