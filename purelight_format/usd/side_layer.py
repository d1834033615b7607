"""The USD layer beside a bundle, `lamp.usda` for `lamp.plux`: is it sound, and made for it?"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_format.files import is_file, read_file
from purelight_format.issues import FormatError, Issue, issue
from purelight_format.limits import Limits
from purelight_format.usd import layer

DIGEST = re.compile(rb'\bpurelight:bundleDigest\s*=\s*"([^"\n]*)"')
BUNDLE = re.compile(rb"\bpurelight:bundle\s*=\s*@([^@\n]*)@")


class _Neighbours:
    """Names of the files in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and is_file(self._folder / name)


def check(bundle: Path, digest: str, limits: Limits) -> Iterator[Issue]:
    """Compares the layer with its bundle; nothing if there is none or it is about another one.

    Its faults are warnings, as they do not touch the bundle.

    Arguments:
        bundle: path of the bundle.
        digest: SHA-256 of its manifest.
        limits: what is accepted.
    """
    path = bundle.with_suffix(".usda")
    if path == bundle or not is_file(path):
        return
    try:
        data = read_file(path, limits.layer_bytes)
        if (named := BUNDLE.search(data)) is None or named[1] != f"./{bundle.name}".encode():
            return
        for found in layer.check(data, path.name, _Neighbours(path.parent), limits):
            yield _warning(path, found)
    except FormatError as error:
        yield _warning(path, error.issue)
        return
    except PureLightError as error:
        yield issue(
            "PLX_SIDE_LAYER_INVALID", path.name, code="file", location="file", message=error
        )
        return
    stated = DIGEST.search(data)
    if stated is None or stated[1] != digest.encode():
        found_digest = stated[1].decode(errors="replace") if stated else ""
        yield issue("PLX_SIDE_DIGEST_MISMATCH", path.name, digest=found_digest)


def _warning(path: Path, found: Issue) -> Issue:
    names = {"code": found.code.name, "location": found.location, "message": found.message}
    return issue("PLX_SIDE_LAYER_INVALID", path.name, **names)
