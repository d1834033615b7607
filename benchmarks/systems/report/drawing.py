"""Figures by matplotlib: fronts of error against seconds, bias against roughness, memory."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

from PIL import Image as Pillow

from benchmarks.systems.report.series import HALL, STRIPS, Results
from purelight_format.errors import PureLightError

Drawn = dict[str, bytes]  # PNG by name
MARKS = "osD^v<>Phd*pX"
COLOURS = 128  # of a figure's file


def fronts(results: Results) -> Drawn:
    """Log-log fronts of each lamp, for what it looks like and for what it lights."""
    made = {}
    for lamp in results.lamps:
        for kind in ("appearance", "illumination"):
            curves = {
                name: [(s.seconds, s.figures["relative_error"]) for s in steps]
                for name in results.systems
                if (steps := results.steps(lamp, name, kind))
            }
            if curves:
                noise = min(
                    s.figures["truth_variance"]
                    for name in curves
                    for s in results.steps(lamp, name, kind)
                )
                made[f"front_{lamp}_{kind}"] = _front(f"{lamp}: {kind}", results, curves, noise)
    return made


def _front(title: str, results: Results, curves: Mapping[str, Any], noise: float) -> bytes:
    def draw(axes: Any) -> None:
        for name, points in curves.items():
            known = [(x, y) for x, y in points if x > 0 and y > 0]
            axes.plot(*zip(*known, strict=True), **look(results, name)) if known else None
        if noise > 0:
            axes.axhline(noise, color="grey", linestyle=":", linewidth=1, label="truth's own noise")
        axes.set(xscale="log", yscale="log", xlabel="seconds", ylabel="relMSE", title=title)

    return png(draw)


def roughness(results: Results) -> Drawn:
    """Bias of each strip's mean radiance against its roughness, with standard errors."""
    made = {}
    for lamp in results.lamps:
        found = {n: r[-1] for n in results.systems if (r := results.last(lamp, n, STRIPS))}
        found = {n: r for n, r in found.items() if r.figures.get("bias")}

        def draw(axes: Any, found: Any = found, lamp: str = lamp) -> None:
            for name, record in found.items():
                known = [
                    (a, 100 * b, 100 * e)
                    for a, b, e in zip(
                        *(record.figures[k] for k in ("alpha", "bias", "bias_noise")), strict=True
                    )
                    if b is not None
                ]
                if known:
                    x, y, error = zip(*known, strict=True)
                    axes.errorbar(x, y, error, capsize=2, **look(results, name))
            axes.axhline(0, color="grey", linewidth=1)
            axes.set(
                xscale="log", xlabel="roughness of the floor (GGX alpha)",
                ylabel="bias of radiance, %", title=f"{lamp}: bias against roughness",
            )  # fmt: skip
            alphas = next(iter(found.values())).figures["alpha"]
            axes.set_xticks(alphas, [f"{a:g}" for a in alphas])
            axes.set_xticks([], minor=True)
            axes.set_yscale("symlog", linthresh=10)

        if found:
            made[f"roughness_{lamp}"] = png(draw)
    return made


def memory(results: Results) -> Drawn:
    """Peak memory against the number of lamps."""
    made = {}
    for lamp in results.lamps:
        curves = {n: instances(results, lamp, n) for n in results.systems}

        def draw(axes: Any, curves: Any = curves, lamp: str = lamp) -> None:
            for name, points in curves.items():
                if points:
                    axes.plot(*zip(*points, strict=True), **look(results, name))
            axes.set(
                xscale="log", ylim=(0, None), xlabel="instances", ylabel="peak memory, MB",
                title=f"{lamp}: memory of instances",
            )  # fmt: skip
            counts = sorted({count for points in curves.values() for count, _ in points})
            axes.set_xticks(counts, [str(count) for count in counts])
            axes.set_xticks([], minor=True)

        if any(curves.values()):
            made[f"memory_{lamp}"] = png(draw)
    return made


def instances(results: Results, lamp: str, system: str) -> list[tuple[int, float]]:
    """Counts of lamps, and peak megabytes with so many."""
    found = results.last(lamp, system, HALL)
    return sorted((int(r.task.removeprefix(HALL)), r.memory) for r in found if r.memory)


def look(results: Results, name: str) -> dict[str, Any]:
    """Mark and colour of a system, the same in all figures."""
    index = results.systems.index(name)
    ours = name.startswith("purelight")
    return {
        "label": name, "marker": MARKS[index % len(MARKS)], "color": f"C{index % 10}",
        "markersize": 4, "linewidth": 2.2 if ours else 1.2,
    }  # fmt: skip


def png(draw: Callable[[Any], None], size: tuple[float, float] = (6.4, 4.4)) -> bytes:
    """A figure with a legend beside it.

    Raises:
        PureLightError: there is no matplotlib.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise PureLightError('figures need matplotlib: pip install "purelight[docs]"') from error
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    draw(axes)
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    buffer = io.BytesIO()
    FigureCanvasAgg(figure).print_png(buffer)
    few = Pillow.open(buffer).convert("RGB").quantize(COLOURS)  # a third of the bytes
    buffer = io.BytesIO()
    few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
