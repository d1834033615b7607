"""One lamp of the gallery, from its shapes to its pictures, in stages that leave stamps."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from purelight_examples.demo import command, version
from purelight_examples.gallery.settings import Settings
from purelight_examples.luminaires.catalog import CATALOG, Entry
from purelight_examples.scenes import lamp_stage
from purelight_examples.scenes.lamp_choice import NeuralLamp
from purelight_examples.stages import Figures, Record, Stage, run_stages
from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere
from purelight_train.presets import SKETCH

Action = Callable[[dict[str, Record]], Figures]


@dataclass(frozen=True)
class LampJob:
    """A lamp of the catalog.

    Arguments:
        folder: of this lamp; stages that are finished in it are not done again.
    """

    name: str
    folder: Path
    settings: Settings

    def __call__(self) -> dict[str, Record]:
        """Run every unfinished stage; returns the records of all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return run_stages(self.folder, self.stages())

    @property
    def entry(self) -> Entry:
        return CATALOG[self.name]

    @property
    def scene(self) -> Path:
        return self.folder / "luminaire" / f"{self.name}.xml"

    @property
    def bundle(self) -> Path:
        return self.folder / "lamp.plux"

    def stages(self) -> list[Stage]:
        """The stages in order; each depends on all before it."""
        s = self.settings
        looks = [self.entry.azimuth, self.entry.elevation]
        wall = [s.wall.width, s.wall.height, s.wall.spp]
        return [
            self._stage("lamp", "Building the lamp", 3,
                        {"scene": self.digest(), "version": version()}, self._build,
                        f"luminaire/{self.scene.name}"),
            self._stage("train", f"Training its networks ({s.preset})", 300, {"preset": s.preset},
                        self._train, "run/metrics.json"),
            self._stage("export", "Exporting lamp.plux", 15, {}, self._export, "lamp.plux"),
            self._stage("validate", "Validating it", 2, {}, self._validate),
            self._stage("portrait", "Path tracing the real lamp by daylight", 20,
                        {"size": s.portrait, "spp": s.portrait_spp, "from": looks}, self._portrait,
                        "portrait.exr"),
            self._stage("seen", "Looking at the lamp", 10, {"size": s.seen, "spp": s.seen_spp},
                        self._seen, "seen.exr"),
            self._stage("wall", "Rendering what it throws onto a wall", 30, {"wall": wall},
                        self._wall, "wall.exr"),
        ]  # fmt: skip

    def digest(self) -> str:
        """Of the files that the lamp is written as."""
        total = hashlib.sha256()
        with tempfile.TemporaryDirectory() as folder:
            self.entry.lamp.write(Path(folder))
            for file in sorted(p for p in Path(folder).rglob("*") if p.is_file()):
                total.update(file.name.encode() + b"\0" + file.read_bytes())
        return total.hexdigest()

    # Stages

    def _build(self, done: dict[str, Record]) -> Figures:
        shutil.rmtree(self.scene.parent, ignore_errors=True)
        self.entry.lamp.write(self.scene.parent)
        parts = self.entry.lamp.parts()
        return {"triangles": sum(len(part.mesh.faces) for part in parts)}

    def _train(self, done: dict[str, Record]) -> Figures:
        """Train, or go on; a run of another lamp or preset is dropped."""
        from purelight_mitsuba import platform
        from purelight_train import cli as train

        run, words = self.folder / "run", [done["lamp"].digest, self.settings.preset]
        key = self.folder / "run.key"
        if not key.exists() or key.read_text() != " ".join(words):
            shutil.rmtree(run, ignore_errors=True)
            atomic.write_bytes(key, " ".join(words).encode())
        anchor = ["--anchor", "straight"] if self.settings.preset == SKETCH.name else []
        command("purelight-train", train.main, [
            str(self.scene), "--output", str(run), "--preset", self.settings.preset, "--seed", "0",
            "--threads", str(self.settings.threads), "--no-report", "--resume", *anchor,
        ])  # fmt: skip
        platform.use()  # training on a GPU leaves its variant
        metrics = json.loads((run / "metrics.json").read_text())
        return {"seconds": sum(metrics["seconds"].values()), "flux": metrics["flux"]}

    def _export(self, done: dict[str, Record]) -> Figures:
        from purelight_export import cli as export

        arguments = [str(self.folder / "run"), "--output", str(self.bundle)]
        command("purelight-export", export.main, arguments)
        return {"bytes": self.bundle.stat().st_size}

    def _validate(self, done: dict[str, Record]) -> Figures:
        from purelight_format import cli as format_cli

        command("purelight-validate", format_cli.validate_main, [str(self.bundle)])
        return {}

    def _portrait(self, done: dict[str, Record]) -> Figures:
        from purelight_examples.gallery.portrait import portrait

        size, spp = self.settings.portrait, self.settings.portrait_spp
        self._keep("portrait", portrait(self.scene, self.entry, self._sphere(), size, spp))
        return {}

    def _seen(self, done: dict[str, Record]) -> Figures:
        from purelight_onnx.luminaire import Luminaire
        from purelight_onnx.viewer import render

        lamp = Luminaire.open(self.bundle, threads=self.settings.threads)
        camera = Camera.orbit(
            self._sphere(), azimuth=self.entry.azimuth, elevation=self.entry.elevation,
            size=self.settings.seen,
        )  # fmt: skip
        self._keep("seen", render(lamp, camera, samples=self.settings.seen_spp))
        return {}

    def _wall(self, done: dict[str, Record]) -> Figures:
        from purelight_examples import rendering

        folder, picture = self.folder / "wall", self.settings.wall
        scene = lamp_stage.write(folder, self.entry, NeuralLamp(self.bundle), picture, "wall")
        rendered = rendering.render(scene, picture.spp, "wall")
        self._keep("wall", rendered.image)
        return {"seconds": rendered.seconds}

    # Pieces

    def _sphere(self) -> BoundingSphere:
        return Bundle.open(self.bundle).manifest.bounding_sphere

    def _keep(self, name: str, image: np.ndarray) -> None:
        from purelight_onnx.picture import write_exr

        write_exr(self.folder / f"{name}.exr", image)

    def _stage(
        self, name: str, title: str, expected: float, settings: Figures, action: Action,
        *outputs: str,
    ) -> Stage:  # fmt: skip
        paths = tuple(self.folder / output for output in outputs)
        return Stage(name, title, expected, settings, action, paths)
