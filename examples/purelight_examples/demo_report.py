"""The demo's report: the room by each method, the lamp itself, and what everything cost."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from purelight_examples.exr import read_exr
from purelight_examples.rendering import Image, errors
from purelight_examples.stages import Record, duration
from purelight_format import atomic
from purelight_format.members.manifest import Manifest
from purelight_format.srgb import png
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from purelight_train.report.difference import relative, relative_scale, shown
from purelight_train.report.grading import Grade, exposure, white_balance
from purelight_train.report.page import Cover, Link, Row, Shot, Table, Wipe, write_page
from purelight_train.truth.picture import means

METHODS = {
    "path": "Path tracing, same time",
    "accurate": "PureLight, accurate",
    "fast": "PureLight, fast",
    "reference": "Reference, light traced",
}
DETAIL = (slice(0.55, 0.86), slice(0.42, 0.73))  # rows and columns, as parts of the picture
BLOCK = 8  # pixels a side, over which errors are shown
PAGE = "lamp.html"
HALF = "room_reference_half.exr"
OWN_PAGE = Link(
    "Turn it yourself",
    "The lamp, in a page that opens from disk and needs no network:", PAGE, "open the lamp",
)  # fmt: skip


def write(folder: Path, lamp: str, done: dict[str, Record], manifest: Manifest) -> None:
    """Write report.html and a PNG beside each EXR of the demo's folder."""
    room = {name: read_exr(folder / f"room_{name}.exr") for name in METHODS}
    seen = {name: read_exr(folder / f"lamp_{name}.exr") for name in ("asset", "reference")}
    gains = white_balance(manifest.flux)
    grade = Grade(gains, exposure(room["reference"] * gains, 90))
    sections: list[Cover | Row | Wipe | Table | Link] = [
        *_cover(manifest),
        Wipe(_shot(grade, "path", room), _shot(grade, "accurate", room)),
        OWN_PAGE,
        _room_row(grade, room, done),
        _detail_row(grade, room),
        _error_row(room, read_exr(folder / HALF)),
        _lamp_row(gains, seen, done),
        _cost_table(done),
        _network_table(manifest, done),
    ]
    pair = np.concatenate((room["path"], room["accurate"]), axis=1)
    for name, image in [*prefixed("room", room | {"pair": pair}), *prefixed("lamp", seen)]:
        own = grade if name.startswith("room") else Grade(gains, exposure(image * gains, 99))
        pixels = png(image * np.asarray(own.gains), own.stops)
        atomic.write_bytes(folder / f"{name}.png", pixels)
    title = f"{lamp.replace('_', ' ').capitalize()}: a lamp as one file"
    write_page(folder / "report.html", title, _lead(done, manifest), sections)


def _cover(manifest: Manifest) -> list[Cover]:
    """The lamp's verdict, if there is one."""
    found = read(manifest.fidelity.get("verdict"))
    if found is None:
        return []
    told = judge(found, manifest.provenance)
    return [Cover(told.caption, told.lines)]


def prefixed(prefix: str, images: dict[str, Image]) -> list[tuple[str, Image]]:
    """Pictures by the name of their file."""
    return [(f"{prefix}_{name}", image) for name, image in images.items()]


def _lead(done: dict[str, Record], manifest: Manifest) -> str:
    flux = " / ".join(f"{f:.3g}" for f in manifest.flux)
    size = done["export"].figures["bytes"] / 1e6
    return (
        f"Trained in {duration(done['train'].figures['seconds'])} on this machine, exported as "
        f"lamp.plux ({size:.1f} MB); flux {flux} W in R, G and B. "
        "Pictures are balanced towards the lamp's colour and share one exposure."
    )


def _shot(grade: Grade, name: str, room: dict[str, Image]) -> Shot:
    return Shot(METHODS[name], grade.uri(room[name]))


def _room_row(grade: Grade, room: dict[str, Image], done: dict[str, Record]) -> Row:
    shots = []
    for name, title in METHODS.items():
        figures = done[name].figures
        error = figures["noise"] if name == "reference" else errors(room[name], room["reference"])
        rows = {
            "time": f"{figures['seconds']:.1f} s",
            "paths per pixel": f"{figures['spp']:,}",
            **_error_rows(error),
        }
        shots.append(Shot(title, grade.uri(room[name]), rows))
    text = (
        "The same room and camera. Errors are against the reference on the right, whose own "
        "figures are its noise, judged from its two halves: no method can measure below it."
    )
    return Row("The room", text, shots)


def _error_rows(error: dict[str, float]) -> dict[str, str]:
    return {
        "MAPE": f"{100 * error['mape']:.1f} %",
        "MAPE of 4x4 pixels": f"{100 * error['mape_blocks']:.1f} %",
        "relative MSE": f"{error['relative_mse']:.4f}",
    }


def _detail_row(grade: Grade, room: dict[str, Image]) -> Row:
    shots = [Shot(METHODS[name], grade.uri(crop(image))) for name, image in room.items()]
    return Row("A detail", "The same pixels, enlarged.", shots)


def crop(image: Image) -> Image:
    """The detail of a picture."""
    height, width = image.shape[:2]
    rows, columns = (
        slice(int(part.start * side), int(part.stop * side))
        for part, side in zip(DETAIL, (height, width), strict=True)
    )
    return image[rows, columns]


def _error_row(room: dict[str, Image], half: Image) -> Row:
    """Relative errors of means over squares of pixels, each map on a scale of its own.

    Arguments:
        half: the mean of one half of the reference's paths.
    """
    true = blocks(room["reference"])
    maps = {METHODS[n]: relative(blocks(room[n]), true) for n in ("path", "accurate", "fast")}
    # The mean of half the paths is as far from that of all as that is from the truth
    maps["The reference's own noise"] = relative(blocks(half), true)
    text = (
        f"By how much {BLOCK}x{BLOCK} pixels are too bright (warm) or too dark (blue), relative to "
        "the reference. Each map has a scale of its own, which is under it; what lies beyond, one "
        "in a hundred at most unless the scale ends at 100 %, has the colour of its end. Noise is "
        "grainy; an error of the lamp would be smooth. The last map is what the others have of it."
    )
    return Row("Where the error is", text, [_map(title, each) for title, each in maps.items()])


def _map(title: str, error: Image) -> Shot:
    scale = relative_scale(error)
    figures = {
        "mean": f"{100 * error.mean():+.1f} %",
        "mean without sign": f"{100 * np.abs(error).mean():.1f} %",
    }
    uri = shown(np.kron(error, np.ones((BLOCK, BLOCK))), scale)
    return Shot(title, uri, figures, f"{100 * scale:.0f} %")


def blocks(image: Image) -> Image:
    """Means over squares of pixels; what is left over at the border is cut off."""
    height, width = (side // BLOCK * BLOCK for side in image.shape[:2])
    return means(image[:height, :width], BLOCK)


def _lamp_row(
    gains: tuple[float, float, float], seen: dict[str, Image], done: dict[str, Record]
) -> Row:
    reference = seen["reference"]
    error = errors(seen["asset"], reference)
    noise = done["view_reference"].figures["noise"]
    lit = reference[reference.sum(-1) > 0] * np.asarray(gains)
    figures = [_error_rows(error), _error_rows(noise)]
    shots = []
    for part, percentile in (("glass", 60), ("filament", 98)):
        grade = Grade(gains, exposure(lit[None], percentile))
        shots.append(Shot(f"Asset, exposed for the {part}", grade.uri(seen["asset"]), figures[0]))
        shots.append(Shot("The real lamp, traced", grade.uri(reference), figures[1]))
    text = (
        "The lamp seen directly, as networks and as glass and wire. The traced picture's own "
        f"figures are its noise after {done['view_reference'].figures['spp']:,} paths per pixel."
    )
    return Row("The lamp itself", text, shots)


def _cost_table(done: dict[str, Record]) -> Table:
    shown = {**METHODS, "plain": "A plain light of equal flux"}
    rows = []
    for name, title in shown.items():
        figures = done[name].figures
        cost = 1e3 * figures["seconds"] / figures["spp"]
        rows.append([title, f"{figures['spp']:,}", f"{figures['seconds']:.1f} s", f"{cost:.0f} ms"])
    header = ("Room", "paths per pixel", "time", "time per path per pixel")
    return Table("What a picture costs", header, rows)


def _network_table(manifest: Manifest, done: dict[str, Record]) -> Table:
    rows = [
        [name.replace("_", " "), f"{info.bytes / 1e3:,.0f} kB", f"{info.macs_per_sample:,}"]
        for name, info in manifest.networks.items()
    ]
    return Table("What the file holds", ("Network", "size", "multiply-adds per sample"), rows)
