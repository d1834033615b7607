"""Verdicts and what was found, side by side."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from purelight_format.verdict.figures import Look, Mode, Verdict
from purelight_format.verdict.words import Judgement, judge

HEAD = (
    "lamp", "light: says", "found", "(noise)", "", "look: says", "detail, haze", "found", "",
    "fast: says", "±", "found", "",
)  # fmt: skip
CLOSE = 1.25  # A claim holds if what is found is no farther off than this times it.


def row(name: str, said: Verdict, found: dict[str, Any]) -> list[str]:
    """A lamp's verdict, and what the same words would be of what was found."""
    true = as_found(said, found)
    told, right = judge(said), judge(true)
    return [
        name, f"{told.light}, {_percent(said.accurate.within)}",
        _percent(true.accurate.within), _percent(true.accurate.noise),
        _light(told.light, right.light, said.accurate, true.accurate),
        told.look or "-", *_looks(said.look, true.look), _agreed(told.look, right.look),
        *_fast(said, true, told, right),
    ]  # fmt: skip


def as_found(said: Verdict, found: dict[str, Any]) -> Verdict:
    """The verdict with the figures that were found in place of its own, where they are the same."""
    look = None if found.get("look") is None else Look(**found["look"])
    fast = None if said.fast is None else replace(said.fast, **found["fast"])
    return replace(said, accurate=replace(said.accurate, **found["accurate"]), fast=fast, look=look)


def markdown(rows: list[list[str]]) -> str:
    """The table."""
    lines = ["| " + " | ".join(HEAD) + " |", "|---" * len(HEAD) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def _light(told: str, right: str, said: Mode, true: Mode) -> str:
    """Whether the light is as near as is claimed, as far as the truth's own noise can tell."""
    if true.within <= CLOSE * said.within:
        return _agreed(told, right)
    if true.within <= true.noise:
        return "lost in noise"
    return "yes, but farther off" if told == right else _agreed(told, right)


def _agreed(told: str, right: str) -> str:
    return "yes" if told == right else f"found {right or 'nothing'}"


def _looks(said: Look | None, true: Look | None) -> tuple[str, str]:
    return _look(said), _look(true)


def _look(look: Look | None) -> str:
    if look is None:
        return "-"
    return f"{look.detail:.2f} ± {look.detail_noise:.2f}, {look.haze:+.2f}"


def _fast(said: Verdict, true: Verdict, told: Judgement, right: Judgement) -> list[str]:
    if said.fast is None or true.fast is None:
        return ["-"] * 4
    word = {True: "ok", False: "not advised", None: "-"}
    agreed = "yes" if told.fast == right.fast else f"found {word[right.fast]}"
    figures = [_percent(said.fast.within), _percent(true.fast.within)]
    return [word[told.fast], *figures, agreed]


def _percent(part: float) -> str:
    return f"{100 * part:.1f} %"
