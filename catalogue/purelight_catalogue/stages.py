"""What each stage of a lamp's work is: commands of this library, run one after another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from purelight_catalogue.entries import PLURAL
from purelight_catalogue.jobs import Job

RUN, BUNDLE = "run", "bundle"  # What a result is to a later job


@dataclass(frozen=True)
class Command:
    """A command of this library.

    Arguments:
        module: that holds its `main`.
        words: its arguments.
        output: file that takes what it prints; none for the log.
    """

    module: str
    words: tuple[str, ...]
    output: str | None = None


@dataclass(frozen=True)
class Place:
    """Where a job works.

    Arguments:
        folder: for what it makes.
        before: folders of the results that it reads, by what they are to it.
        threads: that it may use.
    """

    folder: Path
    before: Mapping[str, Path]
    threads: int


Stage = Callable[[Job, Place], list[Command]]


def train(job: Job, place: Place) -> list[Command]:
    """A lamp's file to trained networks."""
    options: list[str] = []
    for key, values in job.arguments["options"].items():
        for value in values:
            options.append(f"--{key}={value}")
        assert len(values) == 1 or key in PLURAL
    words = (
        job.arguments["file"], "--output", str(place.folder / RUN), *options,
        "--device", job.arguments["device"], "--threads", str(place.threads),
    )  # fmt: skip
    return [Command("purelight_train.cli", words)]


def size(job: Job, place: Place) -> list[Command]:
    """The smallest networks that are near enough to a run's."""
    words = (
        str(place.before[RUN] / RUN), "--output", str(place.folder / RUN),
        "--target-error", str(job.arguments["target_error"]), "--threads", str(place.threads),
    )  # fmt: skip
    return [Command("purelight_train.size_cli", words)]


def export(job: Job, place: Place) -> list[Command]:
    """A run as a bundle, with its USD asset and photometry."""
    name, lumens = job.arguments["name"], job.arguments["lumens"]
    words = [
        str(place.before[RUN] / RUN), "--output", str(place.folder / f"{name}.plux"),
        "--name", name, "--photometry", "ies,ldt", "--issued", job.arguments["issued"],
    ]  # fmt: skip
    if lumens:
        words += ["--lumens", str(lumens)]
    return [Command("purelight_export.cli", tuple(words))]


def check(job: Job, place: Place) -> list[Command]:
    """What the validator says of a bundle, and what the bundle says of itself."""
    bundle = str(place.before[BUNDLE] / f"{job.arguments['name']}.plux")
    validate = Command("purelight_format.cli:validate_main", (bundle, "--json"), "validate.json")
    inspect = Command("purelight_format.cli:inspect_main", (bundle, "--json"), "inspect.json")
    return [validate, inspect]


def picture(job: Job, place: Place) -> list[Command]:
    """The lamp as it is seen from in front."""
    words = (
        str(place.before[BUNDLE] / f"{job.arguments['name']}.plux"),
        "--output", str(place.folder / "picture.exr"), "--size", str(job.arguments["size"]),
        "--spp", "16", "--threads", str(place.threads),
    )  # fmt: skip
    return [Command("purelight_onnx.cli", words)]


def photons(job: Job, place: Place) -> list[Command]:
    """A part of a lamp's light, traced through the scene that was trained."""
    words = (
        "trace", job.arguments["file"], "--run", str(place.before[RUN] / RUN),
        "--paths", str(job.arguments["paths"]), "--seed", str(job.arguments["seed"]),
        "--threads", str(place.threads), "--output", str(place.folder / "part.npz"),
    )  # fmt: skip
    return [Command("purelight_catalogue.photons", words)]


def photometry(job: Job, place: Place) -> list[Command]:
    """All parts of a lamp's light joined."""
    parts = (str(path / "part.npz") for role, path in place.before.items() if role != RUN)
    name, issued = job.arguments["name"], job.arguments["issued"]
    words = ["join", *parts, "--name", name, "--issued", issued, "--output", str(place.folder)]
    if job.arguments["lumens"]:
        words += ["--lumens", str(job.arguments["lumens"]), "--run", str(place.before[RUN] / RUN)]
    return [Command("purelight_catalogue.photons", tuple(words))]


STAGES: Mapping[str, Stage] = {
    "train": train, "size": size, "export": export, "check": check, "picture": picture,
    "photons": photons, "photometry": photometry,
}  # fmt: skip
