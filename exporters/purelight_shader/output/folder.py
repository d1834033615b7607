"""The folder that is made of a bundle: every file in memory first, then on the disk."""

from __future__ import annotations

import json
import re
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader.form.survey import needs_long
from purelight_shader.output import buffers, description, readme
from purelight_shader.output.targets import TARGETS, Made, Target
from purelight_shader.output.vectors import selftest
from purelight_shader.targets import osl
from purelight_shader.translation import Translation, translate

PREFIX = re.compile(r"[a-z][a-z0-9]{0,31}")
ABOUT = "lamp.json"
BUFFERS = (*(name for _, name, _ in buffers.FILES), osl.TABLES)


def write(
    bundle: Bundle, language: str, folder: str | Path, prefix: str = "purelight"
) -> list[Path]:
    """Writes a lamp's functions in a language, and all that belongs to them.

    Arguments:
        bundle: a valid bundle.
        language: a key of `TARGETS`.
        folder: is made if there is none. A lamp that it holds in the same language is replaced.
        prefix: what all names of the lamp begin with.

    Returns:
        The files.

    Raises:
        PureLightError: If the language cannot take the lamp, there is no Slang compiler, or the
            folder cannot be written, or has files of the same names that are not such a lamp's.
    """
    atomic.check_folder(folder)
    held = _held(Path(folder))
    if held not in (None, language):
        raise PureLightError(
            f"{folder}: holds a lamp in {held}, whose files these would replace; "
            "choose another folder"
        )
    content = contents(bundle, language, prefix)
    paths = [Path(folder) / name for name in content]
    for path, data in zip(paths, content.values(), strict=True):
        atomic.check_file(path)
        if held is None and _is_other(path, data):
            raise PureLightError(
                f"{path}: is there and not of a lamp in {language}; choose another folder"
            )
    for path, data in zip(paths, content.values(), strict=True):
        atomic.write_bytes(path, data)
    if held is not None:
        _remove_buffers(Path(folder), content)
    return paths


def _held(folder: Path) -> str | None:
    """The language of the lamp that a folder holds; None if it holds none."""
    try:
        about = json.loads((folder / ABOUT).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    ours = isinstance(about, dict) and {"bundle", "prefix", "selftest"} <= about.keys()
    language = about.get("language") if ours else None
    return language if isinstance(language, str) and language in TARGETS else None


def _is_other(path: Path, data: bytes) -> bool:
    """Whether a file is there that an earlier run for the same lamp, cut off, cannot have left."""
    try:
        return path.read_bytes() != data
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _remove_buffers(folder: Path, content: Collection[str]) -> None:
    """Removes buffers of the lamp that was there before, if that of now has none of the name."""
    for name in BUFFERS:
        if name not in content:
            with suppress(FileNotFoundError):
                (folder / name).unlink()


def contents(bundle: Bundle, language: str, prefix: str = "purelight") -> dict[str, bytes]:
    """The files of the folder by name, README.md last."""
    if not PREFIX.fullmatch(prefix):
        raise PureLightError(f"the prefix {prefix!r} is not of small letters and digits")
    target = TARGETS[language]
    if prefix in target.reserved:
        raise PureLightError(
            f"the prefix {prefix!r} is a word of {target.title} itself; choose another"
        )
    translation = translate(bundle, target.store())
    _require_kinds(translation, target)
    test = selftest(translation)
    about = description.description(translation, test, language, prefix)
    files = target.make(Made(target, translation, test, prefix))
    suffix = next(iter(files)).partition(".")[2]
    pages = target.calling, target.selftest, target.buffers
    return {
        **files,
        **dict(buffers.surface(bundle)),
        **dict(test.files()),
        ABOUT: description.to_bytes(about),
        "README.md": readme.readme(about, target.title, pages, suffix),
    }


def _require_kinds(translation: Translation, target: Target) -> None:
    """Refuses integers that a language does not have."""
    for network, program in translation.programs.items():
        if not target.has_long and needs_long(program):
            raise PureLightError(
                f"{network}: needs integers of 64 bits, which {target.title} does not have; "
                "choose cpp, cuda, glsl, hlsl, metal or slang"
            )
