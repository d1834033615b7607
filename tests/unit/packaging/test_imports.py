"""What each package may import: the table of CONTRIBUTING.md, and no circles."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import packages_distributions
from pathlib import Path

import grimp
import pytest
from grimp import ImportGraph

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BLENDER = {"bpy_extras", "mathutils", "cycles", "openimageio", "pxr"}  # What `bpy` brings.
ROW = re.compile(r"^\| `(?:[\w/]+/)?(purelight_\w+)/` \|[^|]*\|([^|]*)\|([^|]*)\|$", re.MULTILINE)
RIGHT = re.compile(r"`([\w.]+)`(?: in `([\w.]+)`)?")


@dataclass(frozen=True)
class Rights:
    """A row of the table.

    Arguments:
        ours: modules of this project with all below them, and which module alone may, or "".
        extras: of pyproject.toml; their libraries, and NumPy, may be imported.
    """

    ours: tuple[tuple[str, str], ...]
    extras: tuple[str, ...]

    def allow(self, importer: str, imported: str) -> bool:
        """Whether a module may import another one of this project."""
        return any(
            f"{imported}.".startswith(f"{name}.") and importer.endswith(alone)
            for name, alone in self.ours
        )


def table(text: str) -> dict[str, Rights]:
    """The rows by package."""
    return {
        name: Rights(tuple(RIGHT.findall(ours)), tuple(e for e, _ in RIGHT.findall(extras)))
        for name, ours, extras in ROW.findall(text)
    }


TABLE = table((ROOT / "CONTRIBUTING.md").read_text())


@pytest.fixture(scope="module")
def graph() -> ImportGraph:
    """Every import of every package, those inside functions too."""
    return grimp.build_graph(*TABLE, include_external_packages=True, cache_dir=None)


def forbidden(graph: ImportGraph, package: str, rights: Rights) -> list[str]:
    """Imports of a package that it has no right to."""
    libraries = modules_of(rights.extras)
    found = []
    for module in sorted({package, *graph.find_descendants(package)}):
        for imported in sorted(graph.find_modules_directly_imported_by(module)):
            top = imported.split(".")[0]
            if top in TABLE:
                right = top == package or rights.allow(module, imported)
            else:
                right = top.lower() in libraries or top in sys.stdlib_module_names
            if not right:
                found.append(f"{module} -> {imported}")
    return found


def modules_of(extras: tuple[str, ...]) -> set[str]:
    """Modules of the libraries that pyproject.toml names, NumPy's included, in small letters."""
    lines = [*PROJECT["dependencies"], *(line for extra in extras for line in lines_of(extra))]
    names = {re.split("[<>=]", line)[0].lower() for line in lines}
    owners = {
        k.lower(): {owner.lower() for owner in v} for k, v in packages_distributions().items()
    }
    if "bpy" in names:
        names |= BLENDER
    return names | {module for module, owned in owners.items() if names & owned}


def lines_of(extra: str) -> list[str]:
    """Requirements of an extra and of the extras that it holds."""
    lines = []
    for line in PROJECT["optional-dependencies"][extra]:
        inner = re.match(r"purelight\[(.*)\]", line)
        lines += [x for part in inner[1].split(",") for x in lines_of(part)] if inner else [line]
    return lines


def circle_of_modules(graph: ImportGraph) -> list[str]:
    """Modules that import each other round, none if there is no circle."""
    order = {m: graph.find_modules_directly_imported_by(m) for m in sorted(graph.modules)}
    try:
        TopologicalSorter(order).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def circles_of_rooms(graph: ImportGraph) -> set[tuple[str, str]]:
    """Imports without which no room of a package imports itself by way of another."""
    rooms = {parent for module in graph.modules if (parent := module.rpartition(".")[0])}
    return set().union(*(graph.nominate_cycle_breakers(room) for room in rooms))


def test_the_table_names_every_package() -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    packages = {Path(path).name for path in wheel["targets"]["wheel"]["packages"]}
    assert packages == TABLE.keys()


@pytest.mark.parametrize("package", TABLE)
def test_a_package_imports_what_it_may(package: str, graph: ImportGraph) -> None:
    assert forbidden(graph, package, TABLE[package]) == []


def test_what_a_package_may_not_import_is_found(graph: ImportGraph) -> None:
    few = table("| `runtimes/purelight_mitsuba/` | | `purelight_onnx.session` in `luminaire` | |")
    found = forbidden(graph, "purelight_mitsuba", few["purelight_mitsuba"])
    assert "purelight_mitsuba.lamps.luminaire -> purelight_onnx.luminaire" in found
    assert "purelight_mitsuba.lamps.luminaire -> purelight_onnx.session" not in found
    assert "purelight_mitsuba.lamps.luminaire -> mitsuba" in found
    assert not any(line.endswith("-> numpy") for line in found)


def test_nothing_goes_in_circles(graph: ImportGraph) -> None:
    assert circle_of_modules(graph) == []
    assert circles_of_rooms(graph) == set()


def test_circles_are_found() -> None:
    graph = ImportGraph()
    for module in ("a", "a.x", "a.x.one", "a.x.two", "a.y", "a.y.one"):
        graph.add_module(module)
    graph.add_import(importer="a.x.one", imported="a.y.one")
    graph.add_import(importer="a.y.one", imported="a.x.two")
    assert circle_of_modules(graph) == []
    assert circles_of_rooms(graph)
    graph.add_import(importer="a.x.two", imported="a.x.one")
    assert set(circle_of_modules(graph)) == {"a.x.one", "a.x.two", "a.y.one"}
