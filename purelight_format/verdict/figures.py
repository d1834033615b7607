"""The figures of a verdict: `fidelity.verdict` of a manifest (`spec/plux.md`, M15).

Every figure is relative, so that it holds for the lamp at any power and any size.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, TypeVar, get_type_hints

LARGEST = 1e12
SIGNED = {"mean", "below", "around", "above", "pattern", "detail", "haze", "by_heart"}
ZONES = ("below", "around", "above")


@dataclass(frozen=True)
class Places:
    """Light that arrives at places.

    Arguments:
        within: nine tenths of the light have at most this relative error, noise taken out.
        noise: what the same part of the noise alone is below.
        mean: error of all the light together.
    """

    within: float
    noise: float
    mean: float


@dataclass(frozen=True)
class Zones:
    """A number for each third of the directions: up to 60 degrees from -Z, around, from +Z."""

    below: float
    around: float
    above: float


@dataclass(frozen=True)
class Mode(Places):
    """The light of a mode of rendering on spheres around the lamp.

    Arguments:
        pattern: part of the light's patterns that is kept (see `Verdict.pattern`).
        zones: error of the light there.
    """

    pattern: float
    zones: Zones


@dataclass(frozen=True)
class Look:
    """The lamp through a lens.

    Arguments:
        size: of the finest detail that is known, over the picture's width.
        detail: part of it that is kept.
        detail_noise: its standard error.
        haze: how much too bright dark parts are, relative.
        error: mean absolute difference over the mean radiance, noise taken out.
        noise: the same of the truth alone.
    """

    size: float
    detail: float
    detail_noise: float
    haze: float
    error: float
    noise: float


@dataclass(frozen=True)
class Verdict:
    """All of it; what was not measured is None.

    Arguments:
        photons: traced to measure the light.
        accurate, fast: light on spheres of some radii around the lamp, in each mode.
        share: part of the light in each zone.
        pattern: root mean square of the light's patterns: of cells of 4.5 degrees against their
            neighbourhood of 18.
        near: light at places within the lamp's own bounding sphere.
        look: pictures.
        grain: relative variance of one shadow ray in accurate mode.
        by_heart: how much likelier the light that was learned from is than other light, in nats.
    """

    photons: int
    accurate: Mode
    share: Zones
    pattern: float
    fast: Mode | None = None
    near: Places | None = None
    look: Look | None = None
    grain: float | None = None
    by_heart: float | None = None

    def of_networks(self, names: Collection[str]) -> Verdict:
        """Without what is said of networks that a bundle does not carry."""
        fast = self.fast if "fast_map" in names else None
        return replace(self, fast=fast, grain=self.grain if "sampler" in names else None)

    def to_json(self) -> dict[str, Any]:
        """As the manifest holds it; figures to four digits."""
        found: dict[str, Any] = _rounded(asdict(self))
        return found


def read(value: Any) -> Verdict | None:
    """The verdict that a manifest states; None if it is not in the form of M15.

    Fields that are not known are ignored, as newer versions may have more.
    """
    try:
        return _read(value, Verdict)
    except ValueError:
        return None


Group = TypeVar("Group")


def _read(value: Any, kind: type[Group]) -> Group:
    """A group of figures.

    Raises:
        ValueError: it lacks a figure, or one is no number of a sensible size.
    """
    if not isinstance(value, Mapping):
        raise ValueError("no object")
    found = {}
    for name, inner, optional in layout(kind):
        given = value.get(name)
        if given is None and optional:
            continue
        found[name] = _number(name, given) if inner is None else _read(given, inner)
    if "photons" in found:
        found["photons"] = round(found["photons"])
    return kind(**found)


def layout(kind: type) -> Iterator[tuple[str, Any, bool]]:
    """Name, group of figures or None for a number, and whether it may be missing, of each field."""
    hints = get_type_hints(kind)
    for field in fields(kind):
        inner = next((t for t in _kinds(hints[field.name]) if t in GROUPS), None)
        yield field.name, inner, field.default is None


def _kinds(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__args__", (hint,))


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{name}: no number")
    if not -LARGEST * (name in SIGNED) <= value <= LARGEST:
        raise ValueError(f"{name}: no sensible number")
    return float(value)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items() if v is not None}
    return value if isinstance(value, int) else float(f"{value:.4g}")


GROUPS = (Places, Zones, Mode, Look)
