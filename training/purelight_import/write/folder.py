"""The output folder: whole or not at all, and never over what a person has changed."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from purelight_format import atomic
from purelight_format.errors import PureLightError

RECORD, TEXT, KEPT = "parts.json", "parts.txt", "kept.xml"


def check(folder: Path) -> None:
    """Makes sure that a folder may be written, before work is done for it.

    Raises:
        PureLightError: it cannot be, or holds what no import made, or what was changed since.
    """
    atomic.check_folder(folder)
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    record = read_record(folder)
    if record is None:
        raise PureLightError(f"{folder}: holds other files; choose an empty folder")
    if digests(folder) != record.get("files"):
        raise PureLightError(
            f"{folder}: holds an import that was changed since; choose another folder, or delete it"
        )


def read_record(folder: Path) -> dict[str, Any] | None:
    """What an import wrote down about itself; None if there was none."""
    try:
        record = json.loads((folder / RECORD).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) and "files" in record else None


def digests(folder: Path) -> dict[str, str]:
    """SHA-256 of every file but the record, by its path in the folder."""
    return {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file != folder / RECORD
    }


@contextmanager
def replaced(folder: Path, record: dict[str, Any]) -> Iterator[Path]:
    """A new folder that takes the place of another when the block ends well.

    Arguments:
        folder: where it is to be, of which `check` has found nothing wrong.
        record: what to write down beside the files' digests; read when the block has ended.

    Raises:
        PureLightError: it cannot be written.
    """
    draft = folder.parent / f".{folder.name[:64]}.{secrets.token_hex(8)}.tmp"
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        draft.mkdir(parents=True)
        yield draft
        text = json.dumps({**record, "files": digests(draft)}, indent=1, ensure_ascii=False)
        # Names of a file may have half a character, which no text can hold.
        (draft / RECORD).write_bytes(f"{text}\n".encode("utf-8", "replace"))
        _swap(draft, folder)
    except OSError as error:
        raise PureLightError(
            f"{folder}: cannot write: {error.strerror}; nothing was changed"
        ) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        for parent in missing:  # Those that hold the folder now are not empty, and stay.
            with suppress(OSError):
                parent.rmdir()


def _swap(draft: Path, folder: Path) -> None:
    """Puts a folder in the place of another, or its content into one that is there.

    That one is never moved itself: shells and file managers may stand in it.
    """
    if not folder.exists():
        os.replace(draft, folder)
        return
    old = draft.with_suffix(".old")
    old.mkdir()
    moved: list[tuple[Path, Path]] = []
    try:
        for source, target in ((folder, old), (draft, folder)):
            for entry in sorted(source.iterdir()):
                os.replace(entry, target / entry.name)
                moved.append((entry, target / entry.name))
    except BaseException:
        for entry, place in reversed(moved):
            os.replace(place, entry)
        old.rmdir()
        raise
    shutil.rmtree(old, ignore_errors=True)
