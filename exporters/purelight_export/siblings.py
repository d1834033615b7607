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
NO_PATH = re.compile(r"[@:\\[\]\x00-\x1f\x7f\ud800-\udfff]")  # In asset paths (spec/usd.md, U5).


def check_name(bundle: Path) -> None:
    """Makes sure that a name is one of a bundle, and that the USD asset beside it can name it.

    Raises:
        PureLightError: It is not.
    """
    if bundle.suffix != ".plux":
        raise PureLightError(f"{bundle}: the bundle's name must end in .plux")
    found = NO_PATH.search(bundle.name)
    if found:
        raise PureLightError(
            f"{bundle}: a USD layer cannot name a file with {found[0]!r}; give --output another "
            "name"
        )


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


def left_over(written: Sequence[Path]) -> list[Path]:
    """Files of an earlier export of the same bundle that the last one has not written.

    Arguments:
        written: what it has written, the bundle first.
    """
    bundle = written[0]
    beside = (bundle.with_suffix(suffix) for suffix in SIGNS)
    return [path for path in beside if path not in written and _ours(path, bundle)]


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
