"""Files beside a bundle: their names, and whether one that stands there is an earlier export's."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_train.fragment import PLACE

SHAPE, ASSET, FRAGMENT = ".shape.ies", ".usda", ".kept.xml"
HEAD = 1 << 14  # Bytes at a file's begin, in which it says whose it is.


def check_beside(bundle: Path, photometry: Sequence[str], *, kept: bool) -> None:
    """Makes sure that an export replaces no file but its own, before work is done for it.

    Maker's photometry and the model that a lamp was trained from like to have the lamp's name.

    Arguments:
        bundle: that will be written.
        photometry: suffixes of the photometric files beside it, without their dots.
        kept: whether kept parts will be written too.

    Raises:
        PureLightError: a file that is not PureLight's stands where one will be written, or it
            cannot be written there.
    """
    suffixes = [*(f".{kind}" for kind in photometry), SHAPE, ASSET]
    for file in map(bundle.with_suffix, [*suffixes, FRAGMENT] if kept else suffixes):
        atomic.check_file(file)
        if file.exists() and not _ours(file, bundle):
            raise _refusal(file)
    meshes = bundle.with_suffix(FRAGMENT).with_suffix("")
    if kept and meshes.exists() and not bundle.with_suffix(FRAGMENT).exists():
        raise _refusal(meshes)  # With our fragment beside it, its files are that fragment's.


def _refusal(path: Path) -> PureLightError:
    return PureLightError(
        f"{path}: is there, is not of an earlier export, and would be replaced; move it, or give "
        "--output another name"
    )


def _ours(file: Path, bundle: Path) -> bool:
    """Whether an export of this bundle has written a file."""
    try:
        with open(file, "rb") as opened:
            head = opened.read(HEAD)
    except OSError:
        return False
    kind = FRAGMENT if file.name.endswith(FRAGMENT) else file.suffix
    return SIGNS[kind](head, bundle)


def _is_ies(head: bytes, _: Path) -> bool:
    return re.search(rb"^\[MANUFAC\] PureLight\s*$", head, re.MULTILINE) is not None


def _is_eulumdat(head: bytes, _: Path) -> bool:
    return head.partition(b"\n")[0].strip() == b"PureLight"


def _is_asset(head: bytes, bundle: Path) -> bool:
    return f"purelight:bundle = @./{bundle.name}@".encode() in head


def _is_fragment(head: bytes, _: Path) -> bool:
    return f'<default name="{PLACE}"'.encode() in head


SIGNS: dict[str, Callable[[bytes, Path], bool]] = {
    ".ies": _is_ies, ".ldt": _is_eulumdat, ASSET: _is_asset, FRAGMENT: _is_fragment,
}  # fmt: skip
