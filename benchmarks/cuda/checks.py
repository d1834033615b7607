"""The checks: what a variant must show, and what counts as shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cuda import isolated
from purelight_format.bundle import Bundle
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.vectors import Vectors, compare
from purelight_mitsuba.translate.half_precision import half_bound
from tests.support import agreement

REFERENCE = "llvm_ad_rgb"
TRACED = 1e-4  # Metres.
FLIPPED = 0.01  # Share of pixels in which a ray on an edge may meet something else.
HALF_LIGHT = 2e-3  # What half precision does to a block of a picture: measured, 1.3e-3.
PICTURES = tuple(product(("accurate", "fast"), ("fused", "queued")))
WIDTHS = (32, 64, 128, 256, 512)
ROWS = {"cuda": 1 << 22, "llvm": 1 << 13}  # As many as keep the device busy.
LOOP_SPP = {"cuda": 1 << 12, "llvm": 1 << 5}
PASS, FAIL, SKIPPED = "pass", "FAIL", "skipped"
FIGURE, UNMEASURED = "figure", "no figure"  # Of what no verdict depends on.
FIGURES = ("loops", "virtual", "speed")


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    check: str
    verdict: str
    figure: str


@dataclass(frozen=True)
class Subject:
    """A variant, and the lamp with which it is checked."""

    variant: str
    lamp: Path

    def ask(self, name: str, *arguments: Any) -> Any:
        """Calls a function of `on_device` in this variant."""
        return isolated.call(self.variant, name, *arguments)

    @property
    def reference(self) -> Subject:
        """The same lamp in the variant that is tested."""
        return replace(self, variant=REFERENCE)

    @property
    def backend(self) -> str:
        """Of Dr.Jit: `cuda` or `llvm`."""
        return self.variant.split("_")[0]

    @property
    def half(self) -> bool:
        """Whether dense layers have half precision unless asked otherwise."""
        return self.backend == "cuda"


def ray(subject: Subject) -> tuple[str, str]:
    """Rays meet a square where it is."""
    error = subject.ask("traced")
    return _verdict(error <= TRACED), f"distances within {error:.1g} m"


def two_scenes(subject: Subject, spheres: bool) -> tuple[str, str]:
    """Room and lamps are hit in one kernel, where OptiX has one pipeline for both."""
    ours, theirs = (s.ask("layers", subject.lamp, spheres) for s in (subject, subject.reference))
    lamp = (theirs["albedo"] > 0.99).all(-1).mean()  # Only lamps are white.
    differ = np.zeros(theirs["depth"].shape[:2], bool)
    for name, expected in theirs.items():
        differ |= ~np.isclose(ours[name], expected, rtol=1e-3, atol=1e-3).all(-1)
    figure = f"{differ.mean():.2%} of pixels meet something else, {lamp:.0%} show the lamp"
    return _verdict(bool(differ.mean() <= FLIPPED < lamp)), figure


def network(subject: Subject, name: str, half: bool) -> tuple[str, str]:
    """A network meets its golden vectors, in half precision by the bound of half precision."""
    opened = Bundle.open(subject.lamp)
    if name not in opened.manifest.networks:
        return SKIPPED, "the lamp has no such network"
    vectors, scale = opened.vectors(name), opened.manifest.radiance_scale
    results = subject.ask("answers", subject.lamp, name, half)
    bound, judged = vectors.tolerances, np.ones(len(vectors), bool)
    if half:
        model = opened.read(opened.manifest.networks[name].member)
        bound, judged = half_bound(model, vectors, scale)
    comparison = compare(replace(vectors, tolerances=bound), results, scale)
    answers = KINDS[name].outputs
    figure = (
        f"{_excess(results, vectors, bound, judged):.2g} of the bound, "
        f"{_excess(results, vectors, vectors.tolerances):.2g} x tolerance, "
        + ", ".join(
            f"{answers[key].yardstick.name} of {key} {error:.1e}"
            for key, error in comparison.error.items()
        )
        + (f"; {judged.sum()} of {len(judged)} vectors judged" if half else "")
    )
    return _verdict(bool(comparison.passed[judged].all()) and judged.mean() >= 0.5), figure


def picture(subject: Subject, mode: str, engine: str) -> tuple[str, str]:
    """Pictures of a room differ from the reference's by nothing but noise."""
    if mode == "fast" and "fast_map" not in Bundle.open(subject.lamp).manifest.networks:
        return SKIPPED, "the lamp has no fast_map"
    ours = subject.ask("pictures", subject.lamp, mode, engine, 0)
    theirs = subject.reference.ask("pictures", subject.lamp, mode, engine, 1000)
    rounding = HALF_LIGHT if subject.half else agreement.ROUNDING
    p = agreement.p_value(ours, theirs, rounding)
    red, green, blue = ours.mean((0, 1, 2)) / theirs.mean((0, 1, 2))
    means = f"means {red:.4f} {green:.4f} {blue:.4f} of {REFERENCE}'s"
    chance = agreement.SIGNIFICANCE / len(PICTURES)
    return _verdict(bool(np.isfinite(ours).all()) and p > chance), f"p {p:.2g}, {means}"


def loops(subject: Subject) -> tuple[str, str]:
    """Evaluated loops over symbolic ones."""
    seconds = subject.ask("loop_seconds", subject.lamp, LOOP_SPP[subject.backend])
    ratio = seconds["evaluated"] / seconds["symbolic"]
    return FIGURE, f"evaluated loops take {ratio:.2f} x the time of symbolic ones"


def calls(subject: Subject) -> tuple[str, str]:
    """Networks in virtual calls, which the runtime has none of."""
    found = subject.ask("calls")
    ratio = found["called"] / found["inline"]
    return FIGURE, f"{ratio:.2f} x the time of inline, radiance within {found['difference']:.1g}"


def speed(subject: Subject, width: int) -> tuple[str, str]:
    """Evaluations of a network per second beside a product of large matrices."""
    found = subject.ask("speed", width, ROWS[subject.backend])
    share = found["flops"] / found["gemm_flops"]
    gemm = f"{found['gemm_flops'] / 1e9:.0f} GFLOP/s"
    return FIGURE, f"{found['per_second'] / 1e6:.3g} M/s, {share:.0%} of the {gemm} of a GEMM"


def checks(subject: Subject) -> dict[str, Callable[[], tuple[str, str]]]:
    """All checks by name, in order."""
    precisions = (True,) if subject.half else (False, True)
    return {
        "ray": partial(ray, subject),
        "two scenes": partial(two_scenes, subject, False),
        "two scenes, no triangle in the room": partial(two_scenes, subject, True),
        **{
            f"network {name}, {'half' if half else 'single'}": partial(network, subject, name, half)
            for name in KINDS
            for half in precisions
        },
        **{f"picture, {m}, {e}": partial(picture, subject, m, e) for m, e in PICTURES},
        "loops": partial(loops, subject),
        "virtual calls": partial(calls, subject),
        **{f"speed, {width} wide": partial(speed, subject, width) for width in WIDTHS},
    }


def run(subject: Subject, prefixes: Sequence[str]) -> Iterator[Row]:
    """The rows of the chosen checks; one that cannot be made fails, and the others go on."""
    for name, check in checks(subject).items():
        if name.startswith(tuple(prefixes)):
            try:
                verdict, figure = check()
            except Exception as error:  # Of whatever kind: the next check may say more.
                verdict = UNMEASURED if name.startswith(FIGURES) else FAIL
                figure = str(error).splitlines()[0] if str(error) else repr(error)
            yield Row(name, verdict, figure)


def _excess(
    results: dict[str, np.ndarray],
    vectors: Vectors,
    bound: dict[str, np.ndarray],
    judged: np.ndarray | slice = slice(None),
) -> float:
    """The largest error in units of a bound."""
    least = np.finfo(np.float64).tiny
    return max(
        float((np.abs(results[key] - y) / np.maximum(bound[key], least))[judged].max(initial=0))
        for key, y in vectors.outputs.items()
    )


def _verdict(passed: bool) -> str:
    return PASS if passed else FAIL
