"""Which parts emit, how much, and in which colour."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE, lumens
from purelight_format.errors import PureLightError
from purelight_import.model.color import KELVIN, black_body
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import RGB, WHITE, Color, Material, Value
from purelight_import.model.picture import Picture
from purelight_import.parts.choice import chosen, listing
from purelight_import.parts.emitting_sides import facing_out
from purelight_import.parts.pieces import advice

EMISSIVE = "emissive"
LIKELY = re.compile(r"bulb|filament|\bled|led[_\d]|emit|glow|lumin|flame|tube|light", re.IGNORECASE)
AMOUNT = re.compile(r"([\d.eE+-]+)\s*(klm|lm|w|k)$", re.IGNORECASE)
ROUNDING = 1e-9  # of the lumens of all emitters is nothing
MILLIMETRES = 1000.0
SAMPLES = 1 << 14  # of a texture, to know its mean over a part
GRAMMAR = "give NAME, NAME=806lm, NAME=5W or NAME=806lm,2700K"


@dataclass(frozen=True)
class Choice:
    """What one `--emitter` says.

    Arguments:
        pattern: of names; `emissive` is all that emits by the file.
        lumens: of all parts that it fits together; None leaves what the file says.
        kelvin: colour temperature; None leaves the colour.
    """

    pattern: str
    lumens: float | None = None
    kelvin: float | None = None


def parse(text: str) -> Choice:
    """Reads `NAME[=AMOUNT[,AMOUNT]]`, amounts being `806lm`, `0.8klm`, `5W` or `2700K`.

    A watt is one of each channel, 683 lm.

    Raises:
        ValueError: it is not of that form.
    """
    pattern, equals, rest = text.rpartition("=")
    if not equals:
        return Choice(text)
    result = Choice(pattern)
    for word in rest.split(","):
        found = AMOUNT.match(word.strip())
        if not found or not pattern:
            raise ValueError(GRAMMAR)
        value, unit = float(found[1]), found[2].lower()
        if unit == "k":
            result = replace(result, kelvin=kelvin(value))
        else:
            factor = {"lm": 1.0, "klm": 1000.0, "w": LUMENS_PER_WATT}[unit]
            result = replace(result, lumens=value * factor)
            if not 0 < value < math.inf:
                raise ValueError(f"{word}: an emitter needs more than nothing")
    return result


def kelvin(value: float) -> float:
    """A colour temperature.

    Raises:
        ValueError: it is out of range.
    """
    if not KELVIN[0] <= value <= KELVIN[1]:
        raise ValueError(f"{value:g} K: give {KELVIN[0]:g} to {KELVIN[1]:g}")
    return value


def light_up(
    lamp: Lamp, choices: Sequence[Choice], total: float | None, temperature: float | None
) -> Lamp:
    """Makes the chosen parts emit, and no others, to the sides that shine (`facing_out`).

    Light of a surface that is not there everywhere is its emission times its opacity.

    Arguments:
        choices: none is all that emits by the file.
        total: lumens of all emitters together, shared by those that have none of their own.
        temperature: kelvin of those that have none of their own.

    Raises:
        PureLightError: nothing emits, or the lumens do not add up.
    """
    choices = choices or [Choice(EMISSIVE)]
    emitting = {number for choice in choices for number in _found(lamp, choice)}
    if not emitting:
        raise PureLightError(_nothing(lamp))
    state = [_State(sides, lamp) for sides in facing_out(lamp, emitting)]
    for choice in choices:
        _choose([state[number] for number in _found(lamp, choice)], choice)
    for part, s in zip(lamp.parts, state, strict=True):
        if part.radiance is not None and s.radiance is None:
            lamp.notes("parts that emit in the file, but were not chosen, stay dark", part.name)
    _leave_dark(lamp, state)
    if all(s.radiance is not None and not isinstance(s.radiance, Picture) for s in state):
        more = advice(lamp.parts)
        if more:
            lamp.notes(f"all of the lamp emits{more}")
    for s in state:
        s.tint(temperature if s.kelvin is None else s.kelvin)
    _share(state, total)
    return replace(lamp, parts=tuple(
        replace(side, radiance=s.radiance) for part, s in zip(lamp.parts, state, strict=True)
        for side in (s.sides if s.radiance is not None else (part,))
    ))  # fmt: skip


def _leave_dark(lamp: Lamp, state: list[_State]) -> None:
    """Parts of which a picture that shines elsewhere covers nothing but black places."""
    shines = [s.lumens > 0 for s in state]
    if not any(shines):
        return  # which is said where lumens are given, and in the doubts
    for part, s, lit in zip(lamp.parts, state, shines, strict=True):
        if s.radiance is not None and not lit:
            s.radiance = None
            lamp.notes("parts stay dark where their picture of light is black", part.name)


class _State:
    """A part, by the sides that shine, while its light is being settled."""

    def __init__(self, sides: tuple[Part, ...], lamp: Lamp) -> None:
        self.sides, self.notes = sides, lamp.notes
        self.radiance: Color | None = None
        self.kelvin: float | None = None
        self.fixed = False

    @property
    def lumens(self) -> float:
        if self.radiance is None:
            return 0.0
        return sum(lumens(flux(side, self.radiance)) for side in self.sides)

    def light(self) -> None:
        """Gives it what the file says of its light, or one, as far as its surface is there."""
        part = self.sides[0]
        self.radiance = part.radiance or WHITE
        if isinstance(part.material, Material) and part.material.opacity != 1:
            self.radiance, whole = covered(self.radiance, part.material.opacity)
            if not whole:
                self.notes("emission is dimmed by the mean of its alpha, which lies otherwise on "
                           "the surface", part.name)  # fmt: skip

    def scale(self, factor: float) -> None:
        self.radiance = times(self.radiance, factor) if self.radiance is not None else None

    def tint(self, temperature: float | None) -> None:
        """Changes the colour to a temperature's, at the same lumens; textures become grey ones."""
        if temperature is None or self.radiance is None:
            return
        color = black_body(temperature)
        if isinstance(self.radiance, Picture):
            bright = self.radiance.linear @ LUMINANCE.astype(np.float32)
            pixels = bright[..., None] * np.array(color, np.float32)
            self.radiance = replace(self.radiance, pixels=pixels, srgb=False)
        else:
            self.radiance = times(color, float(LUMINANCE @ np.asarray(self.radiance)))


def _found(lamp: Lamp, choice: Choice) -> list[int]:
    """The numbers of the parts that one choice fits."""
    if choice.pattern.lower() == EMISSIVE:
        found = [number for number, part in enumerate(lamp.parts) if part.radiance is not None]
        if not found:
            raise PureLightError(_nothing(lamp))
        return found
    parts = {id(part) for part in chosen(choice.pattern, lamp.parts, "--emitter")}
    return [number for number, part in enumerate(lamp.parts) if id(part) in parts]


def _choose(found: list[_State], choice: Choice) -> None:
    """Lights the parts that one choice fits."""
    for s in found:
        s.light()
        s.kelvin = choice.kelvin
        s.fixed = choice.lumens is not None
    if choice.lumens is not None:
        _give(found, choice.lumens)


def _give(state: list[_State], wanted: float) -> None:
    """Scales the light of parts so that they give so many lumens together."""
    now = sum(s.lumens for s in state)
    if not now > 0:
        raise PureLightError("the chosen emitters are black, so they cannot have lumens")
    for s in state:
        s.scale(wanted / now)


def _share(state: list[_State], total: float | None) -> None:
    """Gives those without lumens of their own what is left of the total."""
    if total is None:
        return
    free = [s for s in state if s.radiance is not None and not s.fixed]
    left = total - sum(s.lumens for s in state if s.fixed)
    if not free:
        _give([s for s in state if s.radiance is not None], total)
    elif left <= ROUNDING * total:
        raise PureLightError(
            f"--lumens {total:g} leaves nothing for the emitters that have none of their own"
        )
    else:
        _give(free, left)


def flux(part: Part, radiance: Color) -> RGB:
    """Power that a part sends out of its front, pi times area times radiance: W per channel."""
    mean = np.asarray(mean_radiance(part, radiance))
    r, g, b = (np.pi * part.mesh.area * mean).tolist()
    return r, g, b


def mean_radiance(part: Part, radiance: Color) -> RGB:
    """The mean over a part's area."""
    if not isinstance(radiance, Picture):
        return radiance
    if part.mesh.uv is None:
        r, g, b = radiance.mean().tolist()
        return r, g, b
    rng = np.random.default_rng(0)
    areas = part.mesh.areas
    chosen_triangles = rng.choice(len(areas), SAMPLES, p=areas / areas.sum())
    u, v = rng.random((2, SAMPLES))
    root = np.sqrt(u)
    weight = np.stack((1 - root, root * (1 - v), root * v), 1)
    uv = np.einsum("nk,nkd->nd", weight, part.mesh.uv[part.mesh.triangles[chosen_triangles]])
    r, g, b = radiance.at(uv).mean(0, dtype=np.float64).tolist()
    return r, g, b


def covered(radiance: Color, opacity: Value) -> tuple[Color, bool]:
    """Emission of what is not there everywhere, and whether it is so at each point.

    Two pictures that lie differently on the surface have no product: one is then dimmed by the
    mean of the other.
    """
    if not isinstance(opacity, Picture):
        return times(radiance, opacity), True
    if not isinstance(radiance, Picture):
        mask = opacity.channels(0, 0, 0)
        return mask.times(radiance), True
    if not opacity.lies_as(radiance):
        return radiance.times(float(opacity.mean()[0])), False
    return radiance.by(opacity), True


def times(color: Color, factor: float) -> Color:
    """A colour or texture times a number."""
    if isinstance(color, Picture):
        return color.times(factor)
    return color[0] * factor, color[1] * factor, color[2] * factor


def _nothing(lamp: Lamp) -> str:
    likely = [p for p in lamp.parts if any(LIKELY.search(name) for name in p.names)]
    example = (likely or list(lamp.parts))[0].name if lamp.parts else "NAME"
    sizes = {p.name: f"({_length(np.ptp(p.mesh.bounds, axis=0).max())})" for p in lamp.parts}
    more = advice(lamp.parts) if len(likely) in (0, len(lamp.parts)) else ""
    return (
        f"nothing in the file emits; choose what does, for example --emitter '{example}=806lm'; "
        f"{listing(example if likely else '', lamp.parts, sizes)}{more}"
    )


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{MILLIMETRES * metres:.3g} mm"
