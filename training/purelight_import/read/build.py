"""Parts as readers find them: names made unique, triangles counted, bounds kept."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.issues import plain
from purelight_import.model import limits
from purelight_import.model.lamp import Part, PointLight
from purelight_import.model.material import Color, Material, Verbatim
from purelight_import.model.mesh import Mesh
from purelight_import.model.names import Names, tidy
from purelight_import.model.notes import Notes


@dataclass
class Builder:
    """Gathers the parts of one file."""

    parts: list[Part] = field(default_factory=list)
    points: list[PointLight] = field(default_factory=list)
    room: list[str] = field(default_factory=list)
    notes: Notes = field(default_factory=Notes)
    triangles: int = 0
    names: Names = field(default_factory=Names)

    def name(self, wanted: str, fallback: str = "part") -> str:
        """A name that no part has yet, of at most `limits.NAME` characters."""
        return self.names.fresh(tidy(wanted) or fallback)

    def add(
        self, wanted: str, mesh: Mesh, material: Material | Verbatim, path: tuple[str, ...],
        radiance: Color | None = None, *, double_sided: bool = False,
    ) -> None:  # fmt: skip
        """Adds a part, unless none of its triangles has an area.

        Raises:
            PureLightError: the lamp has too many triangles, faces name vertices that are none, or
                the part is too far away or too large to compute with.
        """
        self.count(len(mesh.triangles))
        if len(mesh.triangles) and mesh.triangles.max() >= len(mesh.positions):
            raise PureLightError(f"'{plain(wanted, 80)}' names vertices that are not there")
        proper = mesh.proper() if len(mesh.triangles) else None
        if proper is None:
            self.notes("parts without any area are left out", tidy(wanted))
            return
        reach = float(np.abs(proper.bounds).max())
        if reach > limits.COORDINATE:
            raise PureLightError(f"'{plain(wanted, 80)}' reaches out to {reach:.3g}; mend the file")
        names = tuple(dict.fromkeys(filter(None, path)))
        name = self.name(wanted)
        self.parts.append(Part(name, proper, material, names, radiance, double_sided=double_sided))

    def count(self, triangles: int) -> None:
        """Counts triangles before they are made.

        Raises:
            PureLightError: there are too many.
        """
        self.foresee(triangles)
        self.triangles += triangles

    def foresee(self, triangles: int, parts: int = 1) -> None:
        """Makes sure that so many more triangles and parts can be taken.

        Raises:
            PureLightError: they would be.
        """
        if len(self.parts) + parts > limits.PARTS:
            raise PureLightError(f"more than {limits.PARTS:,} parts; join those of one material")
        if self.triangles + triangles > limits.TRIANGLES:
            raise PureLightError(
                f"more than {limits.TRIANGLES:,} triangles; a lamp needs far fewer: decimate it"
            )
