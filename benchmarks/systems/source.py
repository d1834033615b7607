"""What the code of a task or a system is: its file, and those of the bench that it imports."""

from __future__ import annotations

import ast
import hashlib
import inspect
from collections.abc import Iterator
from functools import cache
from pathlib import Path

OWN = "benchmarks"
ROOT = Path(__file__).parents[2]


def source_digest(thing: object) -> str:
    """A word that changes with the file of an object's class and all of `OWN` that leads to."""
    digest = hashlib.sha256()
    for path in sorted(_reached(inspect.getfile(type(thing)))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _reached(file: str) -> frozenset[Path]:
    """A module's file and all that it imports, directly or not."""
    found, waiting = set[Path](), [Path(file)]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path)
    return frozenset(found)


def _imported(path: Path) -> Iterator[Path]:
    """Files of the modules of `OWN` that are named by imports, wherever in the file they stand."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            modules = [name for name in inner if _origin(name)]
            names = modules if len(modules) == len(inner) else [node.module, *modules]
        for name in names:
            if name.split(".")[0] == OWN and (origin := _origin(name)):
                yield origin


def _origin(name: str) -> Path | None:
    """The file of a module; None for what is no module, as a function in one."""
    place = ROOT.joinpath(*name.split("."))
    found = (place.with_suffix(".py"), place / "__init__.py")
    return next((path for path in found if path.is_file()), None)
