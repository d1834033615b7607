"""What could not be taken as the file says: each kind once, with the names it concerns."""

from __future__ import annotations

from dataclasses import dataclass, field

EXAMPLES = 4


@dataclass
class Notes:
    """Gathers names by kind, in the order in which kinds turn up."""

    found: dict[str, list[str]] = field(default_factory=dict)

    def __call__(self, kind: str, name: str = "") -> None:
        """Notes that something of this kind was found at a part or material."""
        names = self.found.setdefault(kind, [])
        if name and name not in names:
            names.append(name)

    def lines(self) -> list[str]:
        """One line for each kind, with a few of the names."""
        return [kind + _among(names) for kind, names in self.found.items()]


def _among(names: list[str]) -> str:
    if not names:
        return ""
    more = f" and {len(names) - EXAMPLES} more" if len(names) > EXAMPLES else ""
    return f" ({', '.join(names[:EXAMPLES])}{more})"
