"""What a scale would take, by its own limits and by the rates of one that was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from benchmarks.systems.own.trained_by import TrainedBy
from benchmarks.systems.protocol import System
from benchmarks.systems.records import Record, Records
from benchmarks.systems.scales import ANY_LAMP, SCALES, Scale
from benchmarks.systems.subjects import ALL_PRESETS
from benchmarks.systems.tasks.truth import Truth
from purelight_format.errors import PureLightError
from purelight_train.presets import Optimisation

HOUR = 3600.0


@dataclass(frozen=True)
class Rates:
    """What was measured of one scale, means over its lamps.

    Arguments:
        path: seconds of a light path of a truth, by kind of task.
        begun: seconds before a series' first picture: loading, compiling.
        training: processor seconds of a lamp's own training, which several systems share.
        ready: by system, processor seconds of making it ready for a lamp, besides that.
        examples: that optimisations by the scale's preset see (`examples`).
    """

    path: dict[str, float]
    begun: float
    training: float
    ready: dict[str, float]
    examples: int

    @staticmethod
    def of(measured: Scale, folder: Path) -> Rates:
        """Of the records and truths in a scale's folder.

        Raises:
            PureLightError: there is no truth or record.
        """
        records = [r for r in Records(folder).current() if r.system and not r.failed]
        truths: dict[str, list[float]] = {}
        for task in measured.tasks(ANY_LAMP, 0.1):
            for file in folder.glob(f"*/truth/{task.name}-*.npz"):
                truth = Truth.load(file)
                truths.setdefault(task.kind, []).append(truth.seconds / truth.paths)
        if not records or not truths:
            raise PureLightError(f"{folder}: nothing is measured there to plan by")
        begun = {r.series: r.warm_up for r in records}
        return Rates(
            {kind: sum(all_) / len(all_) for kind, all_ in truths.items()},
            sum(begun.values()) / len(begun),
            *_ready(records),
            examples(measured),
        )


def _ready(records: Sequence[Record]) -> tuple[float, dict[str, float]]:
    """Means over lamps: processor seconds of their training, and of each system besides."""
    shared: dict[str, float] = {}
    rest: dict[str, dict[str, float]] = {}
    for record in records:
        part = _training(record)
        shared[record.lamp] = max(shared.get(record.lamp, 0.0), part)
        own = float(record.cost.get("seconds", 0.0)) - part
        rest.setdefault(record.system, {})[record.lamp] = own
    ready = {system: sum(own.values()) / len(own) for system, own in rest.items()}
    return sum(shared.values()) / len(shared), ready


def _training(record: Record) -> float:
    """What of a system's cost is the training of the lamp's own networks."""
    parts = record.cost.get("parts", {})
    stages = parts.get("seconds")
    whole = stages.get("training", 0.0) if isinstance(stages, dict) else 0.0
    return float(parts.get("ours", whole))


def examples(scale: Scale) -> int:
    """What the optimisations of a scale's preset see: steps times batch."""
    preset = ALL_PRESETS[scale.preset]
    parts = (getattr(preset, f.name) for f in fields(preset))
    return sum(p.steps * p.batch for p in parts if isinstance(p, Optimisation))


def table(scale: Scale, systems: Sequence[System], rates: Rates) -> str:
    """Hours of one thread by part of the work, as text.

    Series are counted with their whole limit of seconds; making ready is extrapolated by the
    examples that the optimisations see, but for systems whose preset is their own.

    Raises:
        PureLightError: a system or a kind of task has no rate.
    """
    lamps = len(scale.lamps)
    tasks = [t for t in scale.tasks(ANY_LAMP, 0.1) if any(t.kind in s.answers for s in systems)]
    judged = [t for t in tasks if t.measured]
    unknown = [s.name for s in systems if s.name not in rates.ready]
    unknown += sorted({t.kind for t in judged} - set(rates.path))
    if unknown:
        raise PureLightError(f"nothing is measured of {', '.join(unknown)} to plan by")
    series = lamps * sum(t.kind in s.answers for s in systems for t in judged)
    halls = lamps * sum(t.kind in s.answers for s in systems for t in tasks if not t.measured)
    kinds = dict.fromkeys(t.kind for t in judged)
    paths = {k: lamps * sum(scale.paths_of(t) for t in judged if t.kind == k) for k in kinds}
    longer = examples(scale) / rates.examples
    fixed = {s.shared: rates.ready[s.name] for s in systems if isinstance(s, TrainedBy)}
    other = [rates.ready[s.name] for s in systems if not isinstance(s, TrainedBy)]
    ready = (rates.training + sum(other)) * longer + sum(fixed.values())
    rows = {
        f"making {lamps} lamps ready for {len(systems)} systems (preset {scale.preset}, "
        f"{longer:.1f} times the examples)": lamps * ready,
        **{
            f"truths of {kind}, {count:.2g} light paths": count * rates.path[kind]
            for kind, count in paths.items()
        },
        f"{series} series of {scale.limit:g} s at most": series * scale.limit,
        f"loading and compiling of {series + halls} series": (series + halls) * rates.begun,
    }
    lines = [f"| {what} | {seconds / HOUR:.1f} |" for what, seconds in rows.items()]
    total = f"| all | {sum(rows.values()) / HOUR:.1f} |"
    return "\n".join((f"| {scale.name} | hours |", "|---|---|", *lines, total))


def plan(scale: Scale, systems: Sequence[System], output: Path) -> str:
    """The table of a scale, by the largest other scale that was measured in a folder.

    Raises:
        PureLightError: none was.
    """
    others = [s for s in reversed(SCALES.values()) if s.name != scale.name]
    measured = next((s for s in others if Records(output / s.name).lines), None)
    if measured is None:
        names = " or ".join(s.name for s in others)
        raise PureLightError(f"{output}: measure the scale {names} first, to plan by its rates")
    told = f"By the rates of {measured.name}, one thread."
    return f"{table(scale, systems, Rates.of(measured, output / measured.name))}\n\n{told}"
