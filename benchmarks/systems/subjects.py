"""Lamps of the gallery, written, trained and exported by the public commands."""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.systems import isolated
from benchmarks.systems.own.purelight import TRAINING
from benchmarks.systems.protocol import Subject
from benchmarks.zoo.settings import TINY_PRESET
from purelight_examples.demo import command
from purelight_examples.luminaires.catalog import CATALOG
from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_mitsuba.scene_file import load_scene
from purelight_train.presets import PRESETS

ALL_PRESETS = {TINY_PRESET.name: TINY_PRESET, **PRESETS}


@dataclass(frozen=True)
class Facts:
    """A subject and what the harness knows besides.

    Arguments:
        digest: changes with its files, its training and the bundle.
        aperture: of the lenses that look at it.
    """

    subject: Subject
    digest: str
    aperture: float


def subject(name: str, folder: Path, preset: str, threads: int) -> Facts:
    """A lamp that is ready for all systems; does only what is missing in the folder.

    Raises:
        PureLightError: there is no such lamp or preset, or a command failed.
    """
    if name not in CATALOG:
        raise PureLightError(f"no lamp {name}; choose from {' '.join(CATALOG)}")
    if preset not in ALL_PRESETS:
        raise PureLightError(f"no preset {preset}; choose from {' '.join(ALL_PRESETS)}")
    scene = CATALOG[name].lamp.write(folder / "luminaire")
    key = _digest(repr(ALL_PRESETS[preset]).encode(), *_files(scene.parent))
    if not _made(folder, key):
        for _ in isolated.results(make, scene, folder, preset, threads, key):
            pass
    return _facts(name, scene, folder, threads)


def _made(folder: Path, key: str) -> bool:
    path = folder / "lamp.json"
    made = path.is_file() and json.loads(path.read_text())["key"] == key
    return made and (folder / "lamp.plux").is_file() and (folder / TRAINING).is_file()


def _facts(name: str, scene: Path, folder: Path, threads: int) -> Facts:
    bundle = folder / "lamp.plux"
    known = json.loads((folder / "lamp.json").read_text())
    manifest = Bundle.open(bundle).manifest
    sphere, (r, g, b) = manifest.bounding_sphere, manifest.flux
    x, y, z = sphere.center
    made = Subject(
        name, scene, folder / "run", bundle, (x, y, z), sphere.radius, (r, g, b), threads
    )
    return Facts(made, _digest(known["key"].encode(), bundle.read_bytes()), known["aperture"])


def make(scene: Path, folder: Path, preset: str, threads: int, key: str) -> Iterator[None]:
    """Train and export, in a process of its own; ends with what is known of the lamp."""
    from purelight_mitsuba import platform

    run, bundle, begun = folder / "run", folder / "lamp.plux", folder / "run.key"
    if not begun.is_file() or begun.read_text() != key:
        shutil.rmtree(run, ignore_errors=True)
        atomic.write_bytes(begun, key.encode())
    resumed = run.exists()
    seconds = {"training": _timed(lambda: _train(scene, run, preset, threads))}
    if resumed:  # what an interrupted call took is known by the clock alone
        metrics = json.loads((run / "metrics.json").read_text())
        seconds["training"] = sum(metrics["seconds"].values())
    platform.use()  # training on a GPU leaves its variant
    from purelight_export import cli

    words = [str(run), "--output", str(bundle)]
    seconds["export"] = _timed(lambda: command("purelight-export", cli.main, words))
    _write(folder / TRAINING, seconds)
    _write(folder / "lamp.json", {"key": key, "aperture": _aperture(scene)})
    yield None


def _train(scene: Path, run: Path, preset: str, threads: int) -> None:
    from purelight_train import cli

    PRESETS.setdefault(preset, ALL_PRESETS[preset])
    words = [str(scene), "--output", str(run), "--preset", preset, "--seed", "0"]
    words += ["--threads", str(threads), "--no-report", "--no-verdict", "--resume"]
    if preset not in ("draft", "standard", "paper"):
        words += ["--anchor", "straight"]
    command("purelight-train", cli.main, words)


def _aperture(scene: Path) -> float:
    from purelight_train.truth.light_traced import sharp_share
    from purelight_train.truth.thin_lens import aperture_for

    return aperture_for(sharp_share(load_scene(scene)))


def _timed(work: Callable[[], Any]) -> float:
    """Processor seconds of this process."""
    start = time.process_time()
    work()
    return round(time.process_time() - start, 2)


def _write(path: Path, data: dict[str, Any]) -> None:
    atomic.write_bytes(path, (json.dumps(data, indent=2) + "\n").encode())


def _files(folder: Path) -> Iterator[bytes]:
    for file in sorted(p for p in folder.rglob("*") if p.is_file()):
        yield file.name.encode() + b"\0" + file.read_bytes()


def _digest(*parts: bytes) -> str:
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()[:16]
