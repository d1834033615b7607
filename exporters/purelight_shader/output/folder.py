"""The folder that is made of a bundle: every file in memory first, then on the disk."""

from __future__ import annotations

import re
from pathlib import Path

from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader.form.survey import needs_long
from purelight_shader.output import buffers, description, readme
from purelight_shader.output.targets import TARGETS, Made, Target
from purelight_shader.output.vectors import selftest
from purelight_shader.translation import Translation, translate

PREFIX = re.compile(r"[a-z][a-z0-9]{0,31}")


def write(
    bundle: Bundle, language: str, folder: str | Path, prefix: str = "purelight"
) -> list[Path]:
    """Writes a lamp's functions in a language, and all that belongs to them.

    Arguments:
        bundle: a valid bundle.
        language: a key of `TARGETS`.
        folder: is made if there is none; files of the same names are replaced.
        prefix: what all names of the lamp begin with.

    Returns:
        The files.

    Raises:
        PureLightError: If the language cannot take the lamp, there is no Slang compiler, or the
            folder cannot be written.
    """
    atomic.check_folder(folder)
    content = contents(bundle, language, prefix)
    paths = [Path(folder) / name for name in content]
    for path in paths:
        atomic.check_file(path)
    for path, data in zip(paths, content.values(), strict=True):
        atomic.write_bytes(path, data)
    return paths


def contents(bundle: Bundle, language: str, prefix: str = "purelight") -> dict[str, bytes]:
    """The files of the folder by name, README.md last."""
    if not PREFIX.fullmatch(prefix):
        raise PureLightError(f"the prefix {prefix!r} is not of small letters and digits")
    target = TARGETS[language]
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
        "lamp.json": description.to_bytes(about),
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
