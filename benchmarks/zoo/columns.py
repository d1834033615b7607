"""The columns of the zoo's table: which figure, and how bad a value is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.zoo.record import STAGES, Record

Value = float | None


@dataclass(frozen=True)
class Column:
    """A figure of a lamp.

    Arguments:
        title: head of the column.
        style: format of a value.
        find: the value of a record, None where it does not apply or is not known.
        badness: what orders lamps from good to bad.
        bar: largest badness that is good enough.
    """

    title: str
    style: str
    find: Callable[[Record], Value]
    badness: Callable[[float], float] = abs
    bar: float | None = None

    def cell(self, record: Record) -> str:
        value = self.value(record)
        return "-" if value is None else format(value, self.style)

    def value(self, record: Record) -> Value:
        """The value, None if it is no finite number."""
        value = self.find(record)
        return value if value is not None and np.isfinite(value) else None


def at(*path: str) -> Callable[[Record], Value]:
    """A figure by stage and names."""

    def find(record: Record) -> Value:
        value: Any = record.figures(path[0])
        for name in path[1:]:
            value = value.get(name) if isinstance(value, dict) else None
        return None if value is None else float(value)

    return find


def less(value: float) -> float:
    """Badness of what ought to be large."""
    return -value


def _flux(record: Record) -> Value:
    """Student's flux over the traced one, less one, of the channel that is worst."""
    ratios = record.figures("flux").get("student_over_traced", [])
    known = [r - 1 for r in ratios if r is not None and np.isfinite(r)]
    return max(known, key=abs) if known else None


def _tracers(record: Record) -> Value:
    """Our tracer's floor over Mitsuba's, less one, where that has settled."""
    return _over_reference(record, "irradiance")


def _independent(record: Record) -> Value:
    """The rendered floor over Mitsuba's, less one, where that has settled."""
    return _over_reference(record, "rendered")


def _over_reference(record: Record, name: str) -> Value:
    told, true = record.figures("floor").get(name), record.figures("reference")
    if told is None or not true.get("settled"):
        return None
    return float(np.mean(told)) / true["irradiance"] - 1


def _reference_noise(record: Record) -> Value:
    """Standard error of the two columns before."""
    true, own = record.figures("reference"), record.figures("floor")
    if not true.get("settled") or "irradiance" not in own:
        return None
    ours = float(np.linalg.norm(own["standard_error"]) / 3)
    return float(np.hypot(true["standard_error"], ours) / true["irradiance"])


def _path_traced(record: Record) -> Value:
    found = record.figures("appearance").get("path_traced") or {}
    return found["mean"] if found.get("settled") else None


def _training(record: Record) -> Value:
    return record.stages.get("train", {}).get("seconds")


def _total(record: Record) -> Value:
    known = [s.get("seconds", 0.0) for s in record.stages.values()]
    return sum(known) if len(known) == len(STAGES) else None


COLUMNS = (
    Column("flux", "+.3f", _flux, bar=0.005),
    Column("floor", "+.3f", at("floor", "accurate", "mean"), bar=0.02),
    Column("(abs)", ".3f", at("floor", "accurate", "mean_absolute_over_mean"), bar=0.05),
    Column("floor, fast", "+.3f", at("floor", "fast", "mean"), bar=0.03),
    Column("(fast, abs)", ".3f", at("floor", "fast", "mean_absolute_over_mean"), bar=0.05),
    Column("(noise)", ".3f", at("floor", "truth_noise")),
    Column("says ±", ".3f", at("train", "verdict", "accurate", "within")),
    Column("says ±, fast", ".3f", at("train", "verdict", "fast", "within")),
    Column("detail kept", ".2f", at("train", "verdict", "look", "detail"), less),
    Column("own size", "+.3f", at("floor", "at_own_size")),
    Column("floor, Mitsuba", "+.3f", _independent),
    Column("tracer, Mitsuba", "+.3f", _tracers),
    Column("(± Mitsuba)", ".3f", _reference_noise),
    Column("far field", ".3f", at("far_field", "mean_absolute_over_mean")),
    Column("T", "+.3f", at("transmittance", "mean")),
    Column("T (abs)", ".3f", at("transmittance", "absolute")),
    Column("T (noise)", ".3f", at("transmittance", "absolute_of_reference")),
    Column("shadow", "+.3f", at("transmittance", "shadow", "mean")),
    Column("MAPE", ".3f", at("appearance", "mape_without_noise")),
    Column("MAPE (noise)", ".3f", at("appearance", "mape_of_reference")),
    Column("view, path traced", "+.3f", _path_traced),
    Column("ESS", ".2f", at("sampler", "effective_sample_size_of_light"), less),
    Column("ESS, least", ".2f", at("sampler", "effective_sample_size_least"), less),
    Column("map bias", "+.3f", at("fast_map", "irradiance_bias")),
    Column("room", "+.3f", at("room", "accurate", "mean")),
    Column("room MAPE", ".3f", at("room", "accurate", "mape_without_noise")),
    Column("room, fast", "+.3f", at("room", "fast", "mean")),
    Column("fireflies", ".2f", at("room", "accurate", "fireflies")),
    Column("fireflies, fast", ".2f", at("room", "fast", "fireflies")),
    Column("variance, fast", ".2f", at("room", "variance_fast_over_accurate"), bar=1.0),
    Column("near", "+.3f", at("near_field", "mean")),
    Column("near (abs)", ".3f", at("near_field", "absolute")),
    Column("near, worst", ".3f", at("near_field", "worst")),
    Column("s, training", ".0f", _training),
    Column("s, all", ".0f", _total),
    Column("MB", ".1f", at("export", "megabytes")),
)
