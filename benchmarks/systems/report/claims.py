"""What the paper claims, re-tested: each claim, the records it needs, and a verdict from them."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.systems.report.drawing import instances
from benchmarks.systems.report.series import STRIPS, Results, Step, reach

ACCURATE, FAST = "purelight_accurate", "purelight_fast"
DRAFT, DRAFT_FAST = "purelight_draft", "purelight_draft_fast"
PATH, HISTOGRAM = "path", "histogram"
NCL, SHELLS = ("ncl", "ncl_light_traced"), ("shell_4d", "shell_4d_factorised")
SAMPLES, MANY = 64, 1_000_000  # ours, and path tracing's, as in the paper's first figure
FASTER, BIAS = 1.4, 0.03  # times as fast, and the mean error that is called little here
TIMING = 0.02  # of a ratio of times, which tells nothing
VAGUE = 0.03  # relative variance of a truth that tells nothing
GROWTH = 1.2  # of memory from one lamp to the most: no growth is below
# Whether it holds on a lamp (None: the noise does not tell), and figures; None: no records
Finding = tuple[bool | None, str] | None


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Arguments:
        text: what is claimed; `test`: what is asked of the records here.
        judge: of one lamp.
    """

    text: str
    test: str
    judge: Callable[[Results, str], Finding]


@dataclass(frozen=True)
class Verdict:
    """What is found, in a few words, with figures by lamp.

    `holds`, `holds on k of n lamps`, `does not hold`, `too noisy to tell`, or `not measured`; of
    the first three it is said on how many other lamps noise does not let one tell.
    """

    claim: Claim
    word: str
    figures: dict[str, str]


def verdicts(results: Results) -> list[Verdict]:
    """All claims, judged by what is measured."""
    return [verdict(claim, results) for claim in CLAIMS]


def verdict(claim: Claim, results: Results) -> Verdict:
    """One claim on all lamps that have the records for it."""
    found = {lamp: claim.judge(results, lamp) for lamp in results.lamps}
    known = {lamp: finding for lamp, finding in found.items() if finding is not None}
    told = [holds for holds, _ in known.values() if holds is not None]
    if not told:
        word = "too noisy to tell" if known else "not measured"
    elif all(told):
        word = "holds"
    else:
        word = f"holds on {sum(told)} of {len(told)} lamps" if any(told) else "does not hold"
    if told and len(known) > len(told):
        word += f", too noisy to tell on {len(known) - len(told)}"
    return Verdict(claim, word, {lamp: text for lamp, (_, text) in known.items()})


def _at(steps: list[Step], samples: int) -> Step | None:
    """The step of so many samples, or the last below it."""
    able = [s for s in steps if s.samples <= samples]
    return able[-1] if able else None


def _few_samples(name: str) -> Callable[[Results, str], Finding]:
    """By the system of a name."""

    def judge(results: Results, lamp: str) -> Finding:
        kinds = ("illumination", "appearance")
        found = [f for kind in kinds if (f := _beside_path(results, lamp, name, kind))]
        enough = [holds for holds, _ in found if holds is not None]
        text = "; ".join(text for _, text in found)
        return (all(enough) if enough else None, text) if found else None

    return judge


def _beside_path(results: Results, lamp: str, name: str, kind: str) -> Finding:
    """What path tracing needs for the error of a system's few samples."""
    ours = _at(results.steps(lamp, name, kind), SAMPLES)
    if ours is None or ours.samples < SAMPLES:
        return None
    if ours.figures["truth_variance"] > VAGUE:
        return None, f"{kind}: the truth is too noisy to tell"
    theirs = [s for s in results.steps(lamp, PATH, kind) if s.tasks == ours.tasks]
    if not theirs:
        return None
    error = ours.figures["relative_error"]
    told, met = f"{kind}: relMSE {error:.2g} at {ours.samples} spp", reach(theirs, error)
    if met is None:
        why = "lost in the truth's noise" if error <= 0 else "not approached by path tracing"
        return None, f"{told}, {why}"
    how = " (extrapolated as 1 / samples)" if met.extrapolated else ""
    times = f"{met.seconds / ours.seconds:.1f} times our time"
    return met.samples >= MANY, f"{told}; path tracing needs {met.samples:.2g} spp{how}, {times}"


def _quicker(accurate: str, fast: str) -> Callable[[Results, str], Finding]:
    """By the names of two modes of one bundle."""

    def judge(results: Results, lamp: str) -> Finding:
        slow, quick = _common(results, lamp, accurate, fast)
        if slow is None or quick is None:
            return None
        speed = slow.seconds / quick.seconds
        bias, noise = quick.figures["mean"], quick.figures["mean_noise"]
        text = (
            f"{speed:.2f} times as fast at {quick.samples} spp ({1 - 1 / speed:.0%} less time), "
            f"mean {bias:+.1%} (accurate {slow.figures['mean']:+.1%}, standard error {noise:.1%})"
        )
        close = abs(speed - FASTER) <= TIMING * FASTER
        if close or (speed > FASTER and abs(abs(bias) - BIAS) <= noise):
            return None, text
        return speed > FASTER and abs(bias) < BIAS, text

    return judge


def _common(results: Results, lamp: str, one: str, other: str) -> tuple[Step | None, Step | None]:
    """Two systems in the room, at the most samples that both have."""
    ours, theirs = (
        {s.samples: s for s in results.steps(lamp, name, "illumination")} for name in (one, other)
    )
    shared = max(ours.keys() & theirs.keys(), default=0)
    return ours.get(shared), theirs.get(shared)


def _sharper(rivals: tuple[str, ...]) -> Callable[[Results, str], Finding]:
    def judge(results: Results, lamp: str) -> Finding:
        ours = results.steps(lamp, ACCURATE, "appearance")
        if not ours or "sharpness" not in ours[-1].figures:
            return None
        theirs = {n: results.steps(lamp, n, "appearance") for n in rivals}
        theirs = {n: s for n, s in theirs.items() if s and s[-1].tasks == ours[-1].tasks}
        if not theirs:  # of the same views
            return None
        if ours[-1].figures["truth_variance"] > VAGUE:
            return None, "the truth is too noisy to tell"
        mine = ours[-1].figures["sharpness"]
        other = {n: s[-1].figures["sharpness"] for n, s in theirs.items()}
        error = {n: s[-1].figures["mape_without_noise"] for n, s in theirs.items()}
        text = f"sharpness {mine:.2f}, MAPE {ours[-1].figures['mape_without_noise']:.2f}; " + (
            ", ".join(f"{n} {other[n]:.2f}, MAPE {error[n]:.2f}" for n in theirs)
        )
        return all(abs(1 - mine) < abs(1 - s) for s in other.values()), text

    return judge


def _quieter(results: Results, lamp: str) -> Finding:
    ours, theirs = _common(results, lamp, ACCURATE, HISTOGRAM)
    if ours is None or theirs is None:
        return None
    flow, histogram = (step.figures["relative_variance"] for step in (ours, theirs))
    text = f"relative variance at {ours.samples} spp: flow {flow:.3g}, histogram {histogram:.3g}"
    known = {
        s.samples: s.figures["relative_variance"]
        for s in results.steps(lamp, HISTOGRAM, "illumination")
    }
    logs = [
        math.log(known[s.samples] / s.figures["relative_variance"])
        for s in results.steps(lamp, ACCURATE, "illumination")
        if known.get(s.samples, 0) > 0 and s.figures["relative_variance"] > 0
    ]  # each step tells of the samples since the one before
    if len(logs) < 2:
        return flow < histogram, text
    more, error = statistics.fmean(logs), statistics.stdev(logs) / math.sqrt(len(logs))
    text += f"; the histogram's over all steps {math.expm1(more):+.1%} (standard error {error:.1%})"
    return (more > 0 if abs(more) > error else None), text


def _memory(results: Results, lamp: str) -> Finding:
    points = instances(results, lamp, ACCURATE)
    if len(points) < 2:
        return None
    (few, before), (many, after) = points[0], points[-1]
    text = f"{few} lamp {before:.0f} MB, {many} lamps {after:.0f} MB"
    real = instances(results, lamp, PATH)
    if len(real) > 1:
        text += f" (the real lamp, path traced: {real[0][1]:.0f} and {real[-1][1]:.0f} MB)"
    return after < GROWTH * before, text


def _rough(results: Results, lamp: str) -> Finding:
    found = results.last(lamp, FAST, STRIPS)
    if not found or not found[-1].figures.get("bias"):
        return None
    bias = [abs(b) for b in found[-1].figures["bias"] if b is not None]
    alpha, noise = found[-1].figures["alpha"], found[-1].figures["bias_noise"]
    if len(bias) < 2:
        return None
    half = len(bias) // 2
    smooth, rough = (sum(part) / len(part) for part in (bias[:half], bias[half:]))
    text = (
        f"mean |bias| {smooth:.1%} at alpha {alpha[0]} to {alpha[half - 1]}, {rough:.1%} at "
        f"{alpha[half]} to {alpha[-1]} (standard error of a strip up to "
        f"{max(n for n in noise if n is not None):.1%})"
    )
    error = max(n for n in noise if n is not None) / math.sqrt(half)  # of a half's mean
    return (rough < smooth if abs(rough - smooth) > error else None), text


CLAIMS = (
    Claim(
        "64 samples per pixel are less noisy than a million of path tracing",
        f"path tracing needs at least {MANY:,} samples to reach our relMSE at {SAMPLES}",
        _few_samples(ACCURATE),
    ),
    Claim(
        "the same of networks by the preset `draft`, whatever the scale's",
        f"at {SAMPLES} samples of {DRAFT}",
        _few_samples(DRAFT),
    ),
    Claim(
        "fast mode is more than 40 % faster with little bias",
        f"more than {FASTER} times as fast at equal samples in the room, a ratio of times being "
        f"known to {TIMING:.0%}; little is a mean within {BIAS:.0%} of the truth",
        _quicker(ACCURATE, FAST),
    ),
    Claim(
        "the same of networks by the preset `draft`, for fast mode",
        f"{DRAFT_FAST} beside {DRAFT}", _quicker(DRAFT, DRAFT_FAST),
    ),
    Claim(
        "sharper than NCL on complex lamps",
        "the detail it shows is nearer to the truth's than NCL's with targets of either kind",
        _sharper(NCL),
    ),
    Claim(
        "learned on the surface is sharper than on a shell",
        "the detail it shows is nearer to the truth's than that of each shell variant",
        _sharper(SHELLS),
    ),
    Claim(
        "the flow sampler is less noisy than a histogram",
        "its variance in the room is less at equal samples, in the mean of a series", _quieter,
    ),
    Claim(
        "memory does not grow with instances",
        f"peak memory of the most lamps is below {GROWTH} times that of one", _memory,
    ),
    Claim(
        "the bias of fast mode falls as surfaces get rougher",
        "its mean magnitude over the rougher half of the strips is below the smoother half's",
        _rough,
    ),
)  # fmt: skip
