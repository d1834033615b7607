"""Rendering of a converted scene by pyluxcore, for a process without Mitsuba."""

from __future__ import annotations

import contextlib
import json
import math
import time
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems.isolated import peak_megabytes
from benchmarks.systems.protocol import Frame, Image
from purelight_format.errors import PureLightError

DEPTH = 32  # vertices of either path
ROULETTE = 8
POLL = 0.005  # seconds
GROWTH = 1.8  # a frame is late by a hair more often than not, and the next is then not twice it
SETTINGS: dict[str, list[Any]] = {
    "renderengine.type": ["BIDIRCPU"],
    "path.maxdepth": [DEPTH],
    "light.maxdepth": [DEPTH],
    "path.russianroulette.depth": [ROULETTE],
    "path.clamping.variance.maxvalue": [0.0],
    "sampler.type": ["RANDOM"],
    "film.filter.type": ["NONE"],
    "film.imagepipelines.0.0.type": ["NOP"],
    "film.outputs.0.type": ["RGB_IMAGEPIPELINE"],
    "film.outputs.0.index": [0],
    "film.outputs.0.filename": ["unused.exr"],
}


def frames(
    folder: Path, samples: list[int], seed: int, threads: int, engine: str = "BIDIRCPU"
) -> Iterator[Frame]:
    """Pictures of the scene in the folder once they have so many samples a pixel, or more.

    LuxCore is only looked at while it renders, so that a frame may have more samples than asked
    for; one that would have less than `GROWTH` times those of the frame before is left out. Where
    that leaves but one, a second has twice its samples: noise is told by two.

    Arguments:
        engine: BIDIRCPU, or another of LuxCore's to compare with.

    Raises:
        PureLightError: pyluxcore is not installed.
    """
    lux = _library()
    start = time.perf_counter()
    width, height, session = _session(lux, folder, seed, threads, engine)
    session.Start()
    warm_up, begun = time.perf_counter() - start, time.process_time()
    last, made = 0.0, 0

    def frame(wanted: float) -> Frame:
        nonlocal last, made
        count, seconds = _wait(session, math.ceil(wanted * width * height))
        last, made = count / (width * height), made + 1
        return Frame(
            _picture(lux, session, width, height), max(round(last), made), seconds, warm_up,
            peak_megabytes(), time.process_time() - begun,
        )  # fmt: skip

    for wanted in samples:
        if wanted >= GROWTH * last:
            yield frame(wanted)
    if made == 1 and len(samples) > 1:
        yield frame(2 * last)


def _library() -> Any:
    try:
        with contextlib.redirect_stdout(None):  # it tells which libraries it loads
            import pyluxcore
    except ImportError:
        raise PureLightError('pyluxcore is missing; pip install "purelight[bench]"') from None
    pyluxcore.Init(lambda _: None)
    return pyluxcore


def _session(lux: Any, folder: Path, seed: int, threads: int, engine: str) -> tuple[int, int, Any]:
    data = json.loads((folder / "scene.json").read_text())
    width, height = data["size"]
    scene = lux.Scene()
    with np.load(folder / "meshes.npz") as meshes:
        for name in sorted({key.split(".")[0] for key in meshes.files}):
            _define(scene, name, meshes)
    scene.Parse(_properties(lux, data["properties"]))
    own: dict[str, list[Any]] = {
        "renderengine.type": [engine], "renderengine.seed": [seed + 1],
        "native.threads.count": [threads], "film.width": [width], "film.height": [height],
    }  # fmt: skip
    config = lux.RenderConfig(_properties(lux, SETTINGS | own), scene)
    return width, height, lux.RenderSession(config)


def _define(scene: Any, name: str, meshes: Any) -> None:
    vertices, faces = meshes[f"{name}.vertices"], meshes[f"{name}.faces"]
    key = f"{name}.normals"
    normals = [tuple(map(float, n)) for n in meshes[key]] if key in meshes.files else None
    points = [tuple(map(float, p)) for p in vertices]
    triangles = [tuple(map(int, t)) for t in faces]
    scene.DefineMesh(name, points, triangles, normals, None, None, None)


def _properties(lux: Any, values: dict[str, list[Any]]) -> Any:
    found = lux.Properties()
    for key, value in values.items():
        found.Set(lux.Property(key, value))
    return found


def _wait(session: Any, samples: int) -> tuple[float, float]:
    """Samples in all and seconds, once there are as many as wanted."""
    while True:
        session.UpdateStats()
        stats = session.GetStats()
        count = stats.Get("stats.renderengine.total.samplecount").GetFloat()
        if count >= samples:
            return count, stats.Get("stats.renderengine.time").GetFloat()
        time.sleep(POLL)


def _picture(lux: Any, session: Any, width: int, height: int) -> Image:
    buffer = array("f", [0.0] * (3 * width * height))
    session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB_IMAGEPIPELINE, buffer)
    # The first row is the lowest
    return np.array(buffer, np.float64).reshape(height, width, 3)[::-1].copy()
