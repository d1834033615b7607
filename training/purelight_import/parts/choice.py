"""Parts chosen by the name of part, node or material."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Protocol, TypeVar

from purelight_format.errors import PureLightError

LISTED = 12


class Named(Protocol):
    """Something with names."""

    @property
    def names(self) -> tuple[str, ...]:
        """All names by which it may be chosen."""


Item = TypeVar("Item", bound=Named)


def fitting(pattern: str, items: Sequence[Item]) -> list[Item]:
    """The items with a name that fits a pattern (*, ?, [...]), in letters of either case.

    A name that all items have, as that of the file's root, counts only if it fits no other: a
    material `lamp` below a node `lamp` is that material alone.
    """
    shared = set.intersection(*(set(item.names) for item in items)) if items else set()
    found = [item for item in items if _fits(pattern, _own(item.names, shared))]
    return found or [item for item in items if _fits(pattern, item.names)]


def chosen(pattern: str, items: Sequence[Named], option: str) -> list[Named]:
    """The items that a pattern fits, see `fitting`.

    Raises:
        PureLightError: there is none; the line names those that there are.
    """
    found = fitting(pattern, items)
    if not found:
        raise PureLightError(
            f"{option} {pattern}: no part has that name; {listing(pattern, items)}"
        )
    return found


def _fits(pattern: str, names: Sequence[str]) -> bool:
    wanted = pattern.lower()
    return any(name and fnmatchcase(name.lower(), wanted) for name in names)


def _own(names: tuple[str, ...], shared: set[str]) -> list[str]:
    """Names without those that all items have; a name that stands there twice is an own one too."""
    return [name for name in names if name not in shared or names.count(name) > 1]


def listing(pattern: str, items: Sequence[Named], beside: Mapping[str, str] | None = None) -> str:
    """The names that there are, those first that are like a pattern; with what stands beside."""
    beside = beside or {}
    names = sorted({name for item in items for name in item.names if name})
    near = difflib.get_close_matches(pattern, names, LISTED, 0.5)
    shown = list(dict.fromkeys([*near, *(item.names[0] for item in items), *names]))
    more = f" and {len(shown) - LISTED} more" if len(shown) > LISTED else ""
    told = (f"{name} {beside[name]}" if name in beside else name for name in shown[:LISTED])
    return f"there are {', '.join(told)}{more}"
