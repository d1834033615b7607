"""The Slang compiler: where it is, and one run of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_format.issues import plain

VARIABLE = "PURELIGHT_SLANGC"
SECONDS = 300
REMEDY = "pip install 'purelight[shaders]', or name slangc in " + VARIABLE


def find() -> Path:
    """The compiler: the one that a variable names, one on the path, or that of slangtorch.

    Raises:
        PureLightError: If there is none.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_file():
            raise PureLightError(f"{named}: no slangc is there; set {VARIABLE} anew, or unset it")
        return Path(named)
    on_path = shutil.which("slangc")
    if on_path:
        return Path(on_path)
    package = find_spec("slangtorch")  # Found, not imported: that would load PyTorch.
    for folder in (package.submodule_search_locations or []) if package else []:
        for name in ("slangc", "slangc.exe"):
            if (Path(folder) / "bin" / name).is_file():
                return Path(folder) / "bin" / name
    raise PureLightError(f"no Slang compiler was found: {REMEDY}")


def compile_text(text: str, target: str, *, defines: Sequence[str] = (), stage: str) -> str:
    """Compiles a module with one entry point, `selftest`.

    Arguments:
        target: as slangc names it.
        defines: names to define.
        stage: of the entry point.

    Raises:
        PureLightError: If there is no compiler, or it fails or takes too long.
    """
    compiler = find()
    with tempfile.TemporaryDirectory(prefix="purelight-") as folder:
        source, result = Path(folder) / "lamp.slang", Path(folder) / "result"
        source.write_text(text)
        words = [
            str(_runnable(compiler, Path(folder))), str(source), "-target", target,
            "-entry", "selftest", "-stage", stage, "-line-directive-mode", "none",
            *(f"-D{name}" for name in defines), "-o", str(result),
        ]  # fmt: skip
        _run(words, compiler.parent)
        return result.read_text()


def _runnable(compiler: Path, folder: Path) -> Path:
    """The compiler, or a copy of it that may be run."""
    if os.access(compiler, os.X_OK):
        return compiler
    copy = folder / compiler.name
    shutil.copy(compiler, copy)
    copy.chmod(0o700)
    return copy


def _run(words: Sequence[str], libraries: Path) -> None:
    path = os.pathsep.join(
        filter(None, [str(libraries), os.environ.get("LD_LIBRARY_PATH")])
    )  # fmt: skip
    environment = os.environ | {"LD_LIBRARY_PATH": path}
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=SECONDS, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        raise PureLightError(f"slangc took more than {SECONDS} s; the lamp is too large") from None
    except OSError as error:
        raise PureLightError(f"{words[0]}: cannot be run: {error.strerror}; {REMEDY}") from error
    if done.returncode != 0:
        reason = next(iter(done.stderr.strip().splitlines()), f"exit code {done.returncode}")
        raise PureLightError(f"slangc refused the lamp: {plain(reason, 300)}")
