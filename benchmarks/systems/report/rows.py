"""Rows of pictures at equal time: the truth, and beside it each system with its error."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import ImageDraw

from benchmarks.systems.protocol import Image
from benchmarks.systems.records import Record
from benchmarks.systems.report.series import OURS, Results, within
from benchmarks.systems.tasks.truth import Truth
from purelight_format.color import LUMINANCE
from purelight_format.srgb import encode, tone

LEAST, LINES, WIDE = 160, 52, 6  # pixels of a picture's side, and of its text; pictures in a row
TILE = NDArray[np.uint8]
SHOWN = ("room", "view_", "roughness")  # tasks by how they begin


@dataclass(frozen=True)
class Tile:
    """A picture and the lines under it."""

    image: Image
    lines: Sequence[str]


def rows(folder: Path, results: Results) -> dict[str, bytes]:
    """PNG by name, for each lamp and task that is shown."""
    made = {}
    for lamp in results.lamps:
        tasks = dict.fromkeys(
            r.task for r in results.records if r.lamp == lamp and r.task.startswith(SHOWN)
        )
        for task in tasks:
            truth = _truth(folder, lamp, task)
            if truth is not None:
                made[f"row_{lamp}_{task}"] = _row(folder, results, lamp, task, truth)
    return made


def _truth(folder: Path, lamp: str, task: str) -> Truth | None:
    name = folder / lamp / "truth" / f"{task}.txt"
    path = name.with_name(name.read_text()) if name.is_file() else name
    return Truth.load(path) if path.suffix == ".npz" and path.is_file() else None


def _row(folder: Path, results: Results, lamp: str, task: str, truth: Truth) -> bytes:
    ours = [r for r in results.of(lamp, OURS, task) if r.task == task]
    tiles = [Tile(truth.picture.image, ("truth, light traced", f"{truth.paths:.2g} paths"))]
    for name in results.systems:
        records = [r for r in results.of(lamp, name, task) if r.task == task and r.picture]
        chosen = within(records, ours[-1].seconds if ours else None)
        if chosen is not None and (folder / chosen.picture).is_file():
            tiles.append(Tile(chosen.image(folder), _lines(chosen)))
    return sheet(tiles, truth)


def _lines(record: Record) -> tuple[str, ...]:
    error = record.figure("mape"), record.figure("relative_error")
    told = "-" if None in error else f"MAPE {error[0]:.3g} relMSE {error[1]:.2g}"
    return record.system, f"{record.samples} spp, {record.seconds:.2f} s", told


def sheet(tiles: Sequence[Tile], truth: Truth) -> bytes:
    """Pictures in one exposure, that of the truth where it is judged, with their lines below."""
    level = float(np.percentile((truth.picture.image @ LUMINANCE)[truth.mask], 90)) or 1.0
    drawn = [_drawn(tile, level) for tile in tiles]
    blank = np.full_like(drawn[0], 255)
    drawn += [blank] * (-len(drawn) % min(WIDE, len(drawn)))
    wide = min(WIDE, len(drawn))
    lines = [np.concatenate(drawn[k : k + wide], 1) for k in range(0, len(drawn), wide)]
    buffer = io.BytesIO()
    Pillow.fromarray(np.concatenate(lines)).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _drawn(tile: Tile, level: float) -> TILE:
    code = encode(tone(np.maximum(tile.image, 0) / level, 0.0))
    pixels = np.rint(255 * code).astype(np.uint8)
    scale = max(round(LEAST / pixels.shape[0]), 1)
    pixels = pixels.repeat(scale, 0).repeat(scale, 1)
    width = max(pixels.shape[1] + 6, LEAST + 20)
    canvas = Pillow.new("RGB", (width, pixels.shape[0] + LINES), "white")
    canvas.paste(Pillow.fromarray(pixels), (0, 0))
    pen = ImageDraw.Draw(canvas)
    for index, line in enumerate(tile.lines):
        pen.text((2, pixels.shape[0] + 2 + 15 * index), line, fill="black")
    return np.array(canvas)
