"""How faithful a lamp is, in words: the figures that purelight-export writes into a manifest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from purelight_format.members.manifest import Manifest

Words = Callable[[Any, Manifest], str]


def fidelity_words(about: Manifest) -> tuple[list[str], dict[str, Any]]:
    """Says the known figures in words; returns these, and the figures that are left.

    Figures come from a file: whatever has another form than it should is left as it is.
    """
    figures = dict(about.fidelity)
    said = _flux_words(figures, about)
    for key, words in KNOWN.items():
        if text := words(figures.get(key), about):
            said.append(text)
            del figures[key]
    return said, figures


def _flux_words(figures: dict[str, Any], about: Manifest) -> list[str]:
    """How much more or less light the networks give than was traced, and how sure that is.

    Both are estimates from random rays. A difference of up to two of its standard errors, the root
    of the sum of both squares, is to be expected from chance. Takes the figures it says.
    """
    found = {key: figures[key] for key in FLUX if _are_numbers(figures.get(key), 3)}
    student, *errors = (found.get(key) for key in FLUX)
    parts = [_part(error, about) for error in errors]
    known = [
        f"{name} {_percent(part)}"
        for name, part in zip(("networks", "traced light"), parts, strict=True)
        if part is not None
    ]
    lines, errors_known = [], ", ".join(known)
    if student:
        pairs = zip(student, about.flux, strict=True)
        more = [f"{round(100 * (x / flux - 1), 2):+g}" if flux else "none" for x, flux in pairs]
        lines.append(f"brightness against the traced light: {', '.join(more)} % (R, G, B)")
    if student and len(known) == 2:
        chance = _percent(2 * math.hypot(*(part or 0.0 for part in parts)))
        lines[0] += f"; up to {chance} may be chance,"
        lines.append(f"as both are measured with random rays (standard errors: {errors_known})")
    elif known:
        lines.append(f"standard error, relative to the lamp's flux: {errors_known}")
    for key in found:
        del figures[key]
    return lines


def _part(error: list[float] | None, about: Manifest) -> float | None:
    """The largest standard error in W, relative to the lamp's flux in that channel."""
    if error is None:
        return None
    pairs = zip(error, about.flux, strict=True)
    return max((x / flux for x, flux in pairs if flux), default=0.0)


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %"


def _gain_words(value: Any, about: Manifest) -> str:
    if not _are_numbers([value], 1):
        return ""
    times = np.exp(min(float(value), 99.0))
    return f"unseen light is {times:.3g} times likelier than under an even glow"


def _network_words(values: Any, about: Manifest) -> str:
    numbers = list(values.values()) if isinstance(values, Mapping) else []
    if not _are_numbers(numbers, len(numbers)) or not numbers:
        return ""
    return f"networks equal the trained ones within {max(numbers):.2g}"


def _are_numbers(values: Any, count: int) -> bool:
    """Whether it is a list of so many numbers."""
    if not isinstance(values, list) or len(values) != count:
        return False
    return all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in values)


FLUX = ("student_flux", "student_flux_error", "flux_error")
KNOWN: dict[str, Words] = {
    "held_out_gain_nats": _gain_words,
    "onnx_error": _network_words,
}
