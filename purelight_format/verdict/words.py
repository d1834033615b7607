"""A verdict in words: every threshold is here, with its reason.

Train, inspect, render, report and preview all ask this file, so that they say the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from purelight_format.verdict.figures import ZONES, Mode, Verdict

# Light. In a picture of 8 bits a step of grey is about 2 %: a matt wall that is 5 % off cannot be
# told from the true one side by side, and 15 %, a fifth of a stop, only when both are flipped.
GOOD, FAIR = 0.05, 0.15
# Optics calls a detail resolved while half of its contrast is left; a fifth less is barely seen.
RESOLVED, KEPT = 0.5, 0.8
# A third of a stop is the smallest step of a camera's exposure; from half a stop on, glass that
# should be black stands out as grey.
CLEAR, FOGGY = 0.26, 0.41
# Fast mode is for smooth light, off by up to a seventh of a stop. It may be as far off as accurate
# mode is, by what two measurements of the same differ by chance.
SMOOTH, ALIKE = 0.1, 1.2
# Patterns of 5 % are just seen on a wall.
PATTERN = 0.05
# A zone that is off by more than this, and by more than the light is in general, is worth a word.
ZONE = 0.03
FAINT = 1e-3  # share of the light below which a zone is worth none
# Noise of 64 shadow rays: the root of a variance of 16 over 64 is a half.
GRAIN = 16.0
# Nats by which light that was learned from may be likelier; 0.05 are five per cent of density.
BY_HEART = 0.05
LARGER = {"sketch": "draft", "draft": "standard", "standard": "paper"}
WHERE = {"below": "below it", "around": "beside it", "above": "above it"}


@dataclass(frozen=True)
class Judgement:
    """A verdict's words.

    Arguments:
        light: `good`, `fair` or `poor`.
        look: `crisp`, `soft` or `hazy`; empty if it was not measured.
        fast: whether fast mode is recommended; None if the lamp has none.
        on_fast: the sentence on fast mode, empty if the lamp has none.
        lines: sentences on light, look and fast mode, and what would help.
        caption: the same in a few words.
    """

    light: str
    look: str
    fast: bool | None
    on_fast: str
    lines: tuple[str, ...]
    caption: str


def judge(verdict: Verdict, provenance: Mapping[str, Any] | None = None) -> Judgement:
    """What figures mean.

    Arguments:
        provenance: how the lamp was made, as its manifest says, for what would help.
    """
    light, look, fast = _light(verdict.accurate.within), _look(verdict), _fast(verdict)
    help_ = list(_help(verdict, light, look, provenance or {}))
    lines = [_light_line(verdict, light)]
    lines += [_look_line(verdict, look)] if look else []
    on_fast = "" if fast is None else _fast_line(verdict)
    lines += [on_fast] if on_fast else []
    lines += [f"would help: {'; '.join(help_)}"] if help_ else []
    return Judgement(light, look, fast, on_fast, tuple(lines), _caption(verdict, look, fast))


def _caption(verdict: Verdict, look: str, fast: bool | None) -> str:
    """The verdict in a few words, for a picture of a few hundred pixels."""
    mode = "" if fast is None else f"fast mode {'ok' if fast else 'not advised'}"
    return ", ".join(filter(None, (f"light ±{_percent(verdict.accurate.within)}", look, mode)))


# Light


def _light(within: float) -> str:
    return "good" if within <= GOOD else "fair" if within <= FAIR else "poor"


def _light_line(verdict: Verdict, light: str) -> str:
    mode = verdict.accurate
    parts = [f"light in the room within ±{_percent(mode.within)} ({light})", _mean(mode)]
    parts += _zones(verdict)
    if verdict.near is not None:
        parts.append(f"within ±{_percent(verdict.near.within)} between its own parts")
    return ", ".join(parts)


def _mean(mode: Mode) -> str:
    """The error of all the light, or that there is none to speak of."""
    return "right in the mean" if abs(mode.mean) < 0.005 else f"{_signed(mode.mean)} in the mean"


def _zones(verdict: Verdict) -> list[str]:
    """Where light is off by more than in general."""
    told, share = verdict.accurate.zones, verdict.share
    least = max(ZONE, verdict.accurate.within)
    return [
        f"{_signed(getattr(told, zone))} {WHERE[zone]} ({_percent(getattr(share, zone))} of it)"
        for zone in ZONES
        if abs(getattr(told, zone)) > least and getattr(share, zone) >= FAINT
    ]


# Look


def _look(verdict: Verdict) -> str:
    seen = verdict.look
    if seen is None:
        return ""
    if seen.detail < RESOLVED or seen.haze > FOGGY:
        return "hazy"
    surely = seen.detail - seen.detail_noise >= KEPT and seen.error <= FAIR
    return "crisp" if surely and seen.haze <= CLEAR else "soft"


def _look_line(verdict: Verdict, look: str) -> str:
    seen = verdict.look
    assert seen is not None  # There is a word for it.
    size = f"1/{round(1 / seen.size)}" if seen.size > 1e-6 else "any size"
    return (
        f"look: {look}, keeps {_percent(min(max(seen.detail, 0), 1))} of details of {size} of its "
        f"width, {_haze(seen.haze)}, pictures {_percent(seen.error)} off (their truth's noise "
        f"{_percent(seen.noise)})"
    )


def _haze(haze: float) -> str:
    if abs(haze) < 0.02:
        return "dark parts right"
    return f"dark parts {_percent(abs(haze))} too {'bright' if haze > 0 else 'dark'}"


# Fast mode


def _fast(verdict: Verdict) -> bool | None:
    return None if verdict.fast is None else not _why_not(verdict)


def _why_not(verdict: Verdict) -> list[str]:
    """What speaks against fast mode."""
    fast, accurate, found = verdict.fast, verdict.accurate, []
    assert fast is not None
    if verdict.pattern >= PATTERN and fast.pattern < RESOLVED * min(accurate.pattern, 1):
        found.append(
            f"loses its patterns (keeps {_percent(max(fast.pattern, 0))} of their contrast)"
        )
    if fast.within > max(SMOOTH, ALIKE * accurate.within):
        found.append("makes its light blotchy")
    return found


def _fast_line(verdict: Verdict) -> str:
    fast, why = verdict.fast, _why_not(verdict)
    assert fast is not None
    said = f"within ±{_percent(fast.within)}, {_mean(fast)}"
    if why:
        return f"fast mode: not recommended, it {' and '.join(why)}; {said}"
    return f"fast mode: recommended, {said}"


# What would help


def _help(verdict: Verdict, light: str, look: str, provenance: Mapping[str, Any]) -> Iterator[str]:
    """Advice, each with what it follows from."""
    near = verdict.near
    preset, anchor = (str(provenance.get(key)) for key in ("preset", "anchor"))
    tried = provenance.get("tried_anchors")
    untried = not (isinstance(tried, list) and tried)
    if look in ("soft", "hazy") and anchor == "none" and untried:
        yield "--anchor auto, for a picture seen through glass"
    if light != "good" or look in ("soft", "hazy"):
        larger = LARGER.get(preset)
        yield f"a longer training (--preset {larger})" if larger else "a longer training"
    if verdict.by_heart is not None and verdict.by_heart > BY_HEART:
        yield "more photons, as it knows those that it learned from by heart"
    if verdict.grain is not None and verdict.grain > GRAIN:
        yield "many samples per pixel in accurate mode, as its light is hard to aim at"
    if near is not None and near.within > max(FAIR, 2 * verdict.accurate.within):
        yield "no walls or tables within its bounding sphere"


# Numbers


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %" if abs(part) < 0.1 else f"{100 * part:.0f} %"


def _signed(part: float) -> str:
    sign = "+" if part > 0 else "-"
    return f"{sign}{_percent(abs(part))}"
