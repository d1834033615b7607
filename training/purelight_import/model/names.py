"""Names that files and XML can have, each once."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from purelight_import.model import limits


def tidy(name: str) -> str:
    """A name that files and XML can have, as near to the given one as can be.

    A dollar sign would begin a parameter of Mitsuba's XML.
    """
    plain_name = "".join(c if c.isprintable() else " " for c in name)
    return re.sub(r'[\s/\\:*?"<>|&\'$]+', "_", plain_name.strip())[: limits.NAME].strip("._")


@dataclass
class Names:
    """The names of one kind of thing.

    Arguments:
        taken: in lower case.
        counts: how often each was wanted, since there may be many.
    """

    taken: set[str] = field(default_factory=set)
    counts: dict[str, int] = field(default_factory=dict)

    def fresh(self, base: str) -> str:
        """A name that nothing has yet, in whatever case; from now on it is taken."""
        name, count = base, self.counts.get(base.lower(), 1)
        while name.lower() in self.taken:
            count += 1
            name = f"{base}_{count}"
        self.counts[base.lower()] = count
        self.taken.add(name.lower())
        return name
