"""The prims of a stage that are shown, each with all places where it is.

What is instanced is visited once: what is in equal instances by the first of them, with the places
of all of them; prototypes of point instancers below those, and never where they are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.usd import point_instancer
from purelight_format.usd.context import Contexts, Space
from purelight_format.usd_schema import SCHEMA

Matrices = NDArray[np.float64]
Note = Callable[[Any, str], None]
INVISIBLE = ("guide", "proxy")
FURTHEST = 1e18  # From which on squares are not finite in float32
MOST_PLACES = 1_000_000  # Instances of a stage, those of instances included.
WORLD = np.eye(4)[None]


@dataclass(frozen=True)
class Shown:
    """A prim that is shown.

    Arguments:
        prim: The `Usd.Prim`.
        space: In which its transform is to be read.
        places: [K, 4, 4] from that space to the world, for column vectors: one copy each.
    """

    prim: Any
    space: Space
    places: Matrices

    def to_world(self) -> Matrices:
        """The prim's own transforms to the world: [K, 4, 4] for column vectors."""
        return self.places @ self.space.matrix(self.prim)


@dataclass
class Walk:
    """Visits the prims of a stage that are shown at a time.

    Left out are invisible prims with all below them, those of guide and proxy purpose, and the
    fallback lights and exit surfaces of luminaires.

    Arguments:
        stage: A `Usd.Stage`.
        time: A `Usd.TimeCode`.
        note: Is told of instancers that are not shown as they say.
    """

    stage: Any
    time: Any
    note: Note = lambda prim, text: None
    _hidden: set[str] = field(default_factory=set)
    _groups: dict[Any, list[tuple[Any, Matrices]]] = field(default_factory=dict)
    _places: int = 0

    def __post_init__(self) -> None:
        self._contexts = Contexts(self.time)

    def __iter__(self) -> Iterator[Shown]:
        """Each prim after those above it; the insides of instances come last.

        Raises:
            PureLightError: If there are more instances than a scene may have.
        """
        from pxr import Usd

        root = self.stage.GetPseudoRoot()
        yield from self._below(root, Space(self.time), WORLD, Usd.PrimDefaultPredicate)
        while self._groups:
            instances = self._groups.pop(next(iter(self._groups)))
            yield from self._inside(instances)

    def _below(
        self, root: Any, space: Space, places: Matrices, predicate: Any, above: tuple[str, ...] = ()
    ) -> Iterator[Shown]:
        """What is shown of a prim and all below it, without the insides of instances.

        Arguments:
            above: Paths of the point instancers that led here.
        """
        from pxr import Usd

        if not len(places):
            return
        walk = iter(Usd.PrimRange(root, predicate))
        for prim in walk:
            if not self._visible(prim):
                walk.PruneChildren()
                continue
            if SCHEMA in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
                self._hidden.update(stand_ins(prim, "fallback", "exitSurface"))
            if prim.GetTypeName() == "PointInstancer":
                walk.PruneChildren()
                yield from self._instancer(prim, space, places, above)
                continue
            if not len(self._finite(prim, space.matrix(prim)[None])):
                walk.PruneChildren()
                continue
            if _of_purpose(prim):
                yield Shown(prim, space, places)
            if prim.IsInstance():
                walk.PruneChildren()
                self._count(len(places), prim)
                group = self._groups.setdefault(self._contexts.key(prim), [])
                group.append((prim, self._finite(prim, _times(places, space.matrix(prim)))))

    def _finite(self, prim: Any, places: Matrices) -> Matrices:
        """Those of a prim's places [K, 4, 4] that are somewhere; a note if not all are."""
        good = (np.abs(places) < FURTHEST).all((1, 2))
        if good.all():
            return places
        self.note(prim, "a place of it is not finite, and was left out")
        return places[good]

    def _visible(self, prim: Any) -> bool:
        """Whether a prim is seen where what is above it is."""
        from pxr import UsdGeom

        if str(prim.GetPath()) in self._hidden:
            return False
        imageable = UsdGeom.Imageable(prim)
        visibility = imageable.GetVisibilityAttr().Get(self.time) if imageable else None
        return bool(visibility != UsdGeom.Tokens.invisible)

    def _inside(self, instances: list[tuple[Any, Matrices]]) -> Iterator[Shown]:
        """What is below the instances of a group, read from the first of them."""
        from pxr import Usd

        first, predicate = instances[0][0], _even_if_over()
        places = np.concatenate([own for _, own in instances])
        for child in first.GetFilteredChildren(Usd.TraverseInstanceProxies(predicate)):
            yield from self._below(child, Space(self.time, first), places, predicate)

    def _instancer(
        self, prim: Any, space: Space, places: Matrices, above: tuple[str, ...]
    ) -> Iterator[Shown]:
        """What the instances of a point instancer show."""
        path = str(prim.GetPath())
        if not _of_purpose(prim):
            return
        if path in above:
            self.note(prim, "an instancer within its own prototype was left out")
            return
        for prototype, own in point_instancer.instances(prim, self.time, self.note):
            self._count(len(places) * len(own), prim)
            at = _times(_times(places, space.matrix(prim))[:, None], own)
            inner, many = Space(self.time, prototype), self._finite(prim, at.reshape(-1, 4, 4))
            yield from self._below(prototype, inner, many, _even_if_over(), (*above, path))

    def _count(self, more: int, prim: Any) -> None:
        self._places += more
        if self._places > MOST_PLACES:
            raise PureLightError(
                f"{prim.GetPath()}: the stage has more than {MOST_PLACES:,} instances; hide some"
            )


@np.errstate(all="ignore")  # What comes out not finite is told
def _times(first: Matrices, second: Matrices) -> Matrices:
    result: Matrices = first @ second
    return result


def _even_if_over() -> Any:
    """A predicate for prims of prototypes, which are often kept below an `over`."""
    from pxr import Usd

    return Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract


def _of_purpose(prim: Any) -> bool:
    from pxr import UsdGeom

    imageable = UsdGeom.Imageable(prim)
    return not imageable or imageable.ComputePurpose() not in INVISIBLE


def stand_ins(prim: Any, *names: str) -> tuple[str, ...]:
    """Paths of what only stands in for a luminaire: `fallback` lights and `exitSurface`s."""
    relationships = (prim.GetRelationship(f"purelight:{name}") for name in names)
    return tuple(str(path) for rel in relationships for path in rel.GetTargets())
