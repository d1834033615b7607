"""The lamps of a trial: some of the zoo, and broken ones."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

from benchmarks.zoo.lamps.lamp import make

SCENE = '<scene version="3.0.0">\n{}\n</scene>\n'
GLOW = '<emitter type="area"><rgb name="radiance" value="1, 1, 1"/></emitter>'


def write_lamps(folder: Path, count: int, seed: int) -> list[str]:
    """Write that many lamps of the zoo, a folder each; their names."""
    names = []
    for index in range(count):
        lamp = make(seed, index)
        lamp.write(folder / lamp.name)
        names.append(lamp.name)
    return names


def write_table(folder: Path, names: list[str]) -> Path:
    """A table of those lamps, which try no anchors: the engine is on trial, and not the lamps."""
    table = folder / "lamps.csv"
    with open(table, "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("file", "name", "anchor"))
        rows.writerows((f"{name}/lamp.xml", name, "none") for name in names)
    return table


def write_broken(folder: Path) -> list[str]:
    """Write ten lamps that nothing can be made of, each wrong in its own way; their names."""
    for name, write in BROKEN.items():
        (folder / name).mkdir(parents=True)
        write(folder / name)
    return list(BROKEN)


def _scene(*shapes: str) -> Callable[[Path], object]:
    return lambda folder: (folder / "lamp.xml").write_text(SCENE.format("\n".join(shapes)))


def _file(name: str, data: bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(data)


def _ball(inside: str = GLOW, radius: str = "0.05") -> str:
    return (
        f'<shape type="sphere"><float name="radius" value="{radius}"/>'
        f'<bsdf type="diffuse"/>{inside}</shape>'
    )


BROKEN: dict[str, Callable[[Path], object]] = {
    "no-xml": _file("lamp.xml", b"this is no scene"),
    "empty-file": _file("lamp.xml", b""),
    "empty-scene": _scene(),
    "dark": _scene(_ball("")),
    "lost-mesh": _scene(
        f'<shape type="ply"><string name="filename" value="no.ply"/>{GLOW}</shape>'
    ),
    "unknown-plugin": _scene('<shape type="teapot"/>', _ball()),
    "from-infinity": _scene(_ball(""), '<emitter type="constant"/>'),
    "a-point-alone": _scene(
        '<emitter type="point"><rgb name="intensity" value="1, 1, 1"/></emitter>'
    ),
    "no-size": _scene(_ball(radius="0")),
    "cut-off-glb": _file("lamp.glb", b"glTF\2\0\0\0\0\1\0\0JSON"),
}
