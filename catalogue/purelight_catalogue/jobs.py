"""The jobs of a catalogue: a few for each lamp, each named by a digest of all it depends on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from purelight_catalogue.entries import SCENE, Entry
from purelight_catalogue.inputs import input_digest
from purelight_catalogue.version import version
from purelight_format.ray_file.files import is_ray_file
from purelight_train.presets import PRESETS

GIB = float(1 << 30)
# GiB at the peak, measured on lamps of the zoo and rounded up; `paper` as on its GPU's host
TRAINING = {"sketch": 2.0, "draft": 3.0, "standard": 6.0, "paper": 16.0}
SMALL = 1.5
TRACING = 2.0
PART = 1 << 24  # photons of one task: minutes of a core
NEEDED = ("train", "size", "export", "check")  # Stages without which a lamp has no card


@dataclass(frozen=True)
class Settings:
    """What is asked for all lamps; what an entry says itself goes first.

    Arguments:
        preset, seed: of `purelight-train`.
        target_error: of `purelight-size`; none to leave the networks as they are.
        picture: pixels along each side of a lamp's picture.
        photons: to trace besides, for flux, far field and a picture that are known well.
        device: of training; a GPU is a resource that a job asks for.
        issued: date in photometric files, YYYY-MM-DD.
    """

    preset: str = "draft"
    seed: int = 0
    target_error: float | None = None
    picture: int = 384
    photons: int = 0
    device: str = "cpu"
    issued: str = "2000-01-01"


@dataclass(frozen=True)
class Job:
    """One stage of one lamp.

    Arguments:
        stage: what kind of work it is, a key of `stages.STAGES`.
        key: SHA-256 of the version, the stage, its arguments and the keys before it, where what
            is before changes it. Equal keys have equal results, whoever computes them.
        lamp: for people; another lamp with the same key has the same result.
        arguments: of the stage, as JSON has them.
        before: keys of the jobs whose results it reads, by what they are to it.
        gibibytes: memory that it may take.
        gpu: whether it needs one.
    """

    stage: str
    key: str
    lamp: str
    arguments: Mapping[str, Any]
    before: Mapping[str, str]
    gibibytes: float = SMALL
    gpu: bool = False

    @property
    def title(self) -> str:
        """For people and logs."""
        return f"{self.lamp}: {self.stage}"


def jobs_of(entry: Entry, settings: Settings) -> list[Job]:
    """The jobs of a lamp, each behind those that it needs.

    Raises:
        PureLightError: its file is not there, or its options are none.
    """
    options = {"preset": (settings.preset,), "seed": (str(settings.seed),), **entry.options}
    training = TRAINING.get(str(options["preset"][0]), max(TRAINING.values()))
    gpu = settings.device == "cuda"
    train = _job("train", entry, {}, training, gpu=gpu, file=str(entry.file.resolve()),
                 digest=input_digest(entry.file), device=settings.device,
                 options={key: list(value) for key, value in sorted(options.items())})  # fmt: skip
    target = entry.target_error or settings.target_error
    jobs = [train]
    if target:
        jobs.append(_job("size", entry, {"run": train}, training, target_error=target))
    export = _job("export", entry, {"run": jobs[-1]}, name=entry.name, lumens=entry.lumens,
                  issued=settings.issued)  # fmt: skip
    check = _job("check", entry, {"bundle": export}, name=entry.name)
    picture = _job("picture", entry, {"bundle": export}, name=entry.name, size=settings.picture)
    return [*jobs, export, check, picture, *_photons(entry, train, settings)]


def _photons(entry: Entry, train: Job, settings: Settings) -> list[Job]:
    """Tracing in parts, and what joins them; nothing of measured rays, which cannot be traced."""
    if not settings.photons or is_ray_file(entry.file):
        return []
    parts = [_part(entry, train, 1 + number) for number in range(-(-settings.photons // PART))]
    before = {f"part {number}": part for number, part in enumerate(parts)}
    join = _job("photometry", entry, {"run": train, **before}, name=entry.name,
                lumens=entry.lumens, issued=settings.issued)  # fmt: skip
    return [*parts, join]


def _part(entry: Entry, train: Job, seed: int) -> Job:
    """A part of the light of the scene that was trained.

    The training has made that scene where the lamp is of another format. How it learns changes
    nothing of it, so its key is not in this one's: another preset does not trace anew.
    """
    arguments = {
        "file": train.arguments["file"], "digest": train.arguments["digest"],
        "options": {key: list(entry.options[key]) for key in SCENE if key in entry.options},
        "paths": PART, "seed": seed,
    }  # fmt: skip
    key = job_key("photons", arguments, {})
    return Job("photons", key, entry.name, arguments, {"run": train.key}, TRACING)


def _job(
    stage: str, entry: Entry, before: Mapping[str, Job], gibibytes: float = SMALL,
    *, gpu: bool = False, **arguments: Any,
) -> Job:  # fmt: skip
    keys = {role: job.key for role, job in before.items()}
    return Job(stage, job_key(stage, arguments, keys), entry.name, arguments, keys, gibibytes, gpu)


def job_key(stage: str, arguments: Mapping[str, Any], before: Mapping[str, str]) -> str:
    """The digest that names a job's result; where a file lies is no part of it, its bytes are."""
    known = {key: value for key, value in arguments.items() if key != "file"}
    text = json.dumps([version(), stage, known, before], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def check_presets(entries: Sequence[Entry], usual: str) -> list[str]:
    """Presets that nobody knows, each once; the usual one is of lamps that name none."""
    named = {entry.options.get("preset", (usual,))[0] for entry in entries}
    return sorted(named - set(PRESETS))
