"""How faithful a lamp is, in words: the figures that purelight-export writes into a manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from purelight_format.manifest import Manifest

Words = Callable[[Any, Manifest], str]


def fidelity_words(about: Manifest) -> tuple[list[str], dict[str, Any]]:
    """Says the known figures in words; returns these, and the figures that are left.

    Figures come from a file: whatever has another form than it should is left as it is.
    """
    figures, said = dict(about.fidelity), []
    for key, words in KNOWN.items():
        if text := words(figures.get(key), about):
            said.append(text)
            del figures[key]
    return said, figures


def _flux_words(values: Any, about: Manifest) -> str:
    """How much more or less the networks give off than the traced lamp."""
    if not _are_numbers(values, 3):
        return ""
    pairs = zip(values, about.flux, strict=True)
    more = [f"{100 * (x / flux - 1):+.2g}" if flux else "none" for x, flux in pairs]
    return f"gives off {', '.join(more)} % (R, G, B) against the traced lamp"


def _spread_words(what: str) -> Words:
    """A standard error in W, relative to the lamp's flux."""

    def words(values: Any, about: Manifest) -> str:
        if not _are_numbers(values, 3):
            return ""
        pairs = [(x, flux) for x, flux in zip(values, about.flux, strict=True) if flux]
        return f"{what} within {max((x / flux for x, flux in pairs), default=0):.2%}"

    return words


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


KNOWN: dict[str, Words] = {
    "student_flux": _flux_words,
    "student_flux_error": _spread_words("that figure is known"),
    "flux_error": _spread_words("the traced flux is known"),
    "held_out_gain_nats": _gain_words,
    "onnx_error": _network_words,
}
