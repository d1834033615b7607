"""Parts chosen by the name of part, node or material."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Protocol

from purelight_format.errors import PureLightError

LISTED = 12


class Named(Protocol):
    """Something with names."""

    @property
    def names(self) -> tuple[str, ...]:
        """All names by which it may be chosen."""


def matches(pattern: str, item: Named) -> bool:
    """Whether any name of an item fits a pattern (*, ?, [...]), in letters of either case."""
    wanted = pattern.lower()
    return any(name and fnmatchcase(name.lower(), wanted) for name in item.names)


def chosen(pattern: str, items: Sequence[Named], option: str) -> list[Named]:
    """The items that a pattern fits.

    Raises:
        PureLightError: there is none; the line names those that there are.
    """
    found = [item for item in items if matches(pattern, item)]
    if not found:
        raise PureLightError(
            f"{option} {pattern}: no part has that name; {listing(pattern, items)}"
        )
    return found


def listing(pattern: str, items: Sequence[Named]) -> str:
    """The names that there are, those first that are like a pattern."""
    names = sorted({name for item in items for name in item.names if name})
    near = difflib.get_close_matches(pattern, names, LISTED, 0.5)
    shown = list(dict.fromkeys([*near, *(item.names[0] for item in items), *names]))
    more = f" and {len(shown) - LISTED} more" if len(shown) > LISTED else ""
    return f"there are {', '.join(shown[:LISTED])}{more}"
