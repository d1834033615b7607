"""Vetting of a bundle's USD layer before any USD library opens it.

OpenUSD composes what a layer names, from any place the process can read; so a layer may only name
members of its own bundle, and may not compose at all.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Container, Iterable, Iterator

from purelight_format.issues import Issue, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.usd.text import Prim, Property, Value, read
from purelight_format.usd_schema import SCHEMA

ENDINGS = (".usd", ".usda", ".usdc", ".usdz")


def check(
    data: bytes, name: str, members: Container[str], limits: Limits = LIMITS
) -> Iterator[Issue]:
    """Checks a layer.

    Arguments:
        data: its bytes.
        name: the member it is.
        members: the names of the bundle's members.
        limits: what is accepted.

    Raises:
        FormatError: If its text is not of the grammar.
    """
    layer = read(data, name, limits)
    roots = {prim.name for prim in layer.children}
    if not [v for v in _texts(layer, "defaultPrim") if v in roots]:
        yield issue("PLX_USD_NO_DEFAULT_PRIM", name)
    if not any(SCHEMA in _texts(prim, "apiSchemas") for prim in layer.tree()):
        yield issue("PLX_USD_SCHEMA_MISSING", name)
    if not _in_metres(layer):
        yield issue("PLX_USD_METERS_PER_UNIT", name)
    for path in paths(layer):
        yield from _check_path(path, name, members)


def paths(layer: Prim) -> Iterator[str]:
    """The asset paths of a layer."""
    for prim in layer.tree():
        yield from _paths(prim.metadata)
        yield from _paths(prim.properties)


def _paths(properties: Iterable[Property]) -> Iterator[str]:
    for found in properties:
        yield from _paths(found.metadata)
        if found.value is not None:
            yield from found.value.items if found.value.kind == "path" else ()
            yield from _paths(found.value.entries)


def _texts(prim: Prim, name: str) -> list[str]:
    """The quotations that a prim's metadata holds under a name."""
    return [t for v in prim.stated(name) if v and v.kind == "text" for t in v.items]


def _in_metres(layer: Prim) -> bool:
    metres, axes = layer.stated("metersPerUnit"), layer.stated("upAxis")
    stated = metres[0].items if len(metres) == 1 and metres[0] else ()
    return bool(len(stated) == 1 and re.fullmatch(r"1(\.0*)?", stated[0])) and axes == [
        Value("text", ("Z",))
    ]


def _check_path(path: str, name: str, members: Container[str]) -> Iterator[Issue]:
    target = posixpath.normpath(path)  # The layer lies in no folder (U1).
    if not path.startswith("./") or ".." in path.split("/") or re.search(r"[\\:\[\]]", path):
        yield issue("PLX_USD_PATH", name, path=path[:200])
    elif target == name:
        return  # The asset's own identifier.
    elif target.lower().endswith(ENDINGS):
        yield issue("PLX_USD_REFERENCES_LAYER", name, path=path[:200])
    elif target not in members:
        yield issue("PLX_USD_PATH_DANGLING", name, path=path[:200])
