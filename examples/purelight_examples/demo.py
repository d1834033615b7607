"""The whole job on a built-in lamp: make it, train, export, render, compare, report."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from purelight_examples import demo_report, rendering
from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.luminaires.lamp_scene import write_xml
from purelight_examples.scenes import room
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp, RealLamp, SphereLamp
from purelight_examples.scenes.lamp_view import view_scene
from purelight_examples.stages import Figures, Record, Stage, run_stages
from purelight_export import cli as export_cli
from purelight_format.bundle import Bundle
from purelight_format.camera import Camera
from purelight_format.errors import PureLightError
from purelight_mitsuba import platform
from purelight_onnx import web_page
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.picture import write_exr
from purelight_onnx.viewer import render as view
from purelight_train import cli as train_cli

# Light tracing joins rough glass to the camera; only a path tracer sees through clear glass
VIEWED_BY = {"frosted_globe": "ptracer", "filament_bulb": "path", "crystal": "path"}
LAMPS = {name: CATALOG[name].lamp for name in VIEWED_BY}


ROOM_PICTURE = room.Picture(480, 360, 28)


@dataclass(frozen=True)
class Demo:
    """What to make, and where.

    Arguments:
        folder: receives everything; stages that are finished in it are not done again.
        preset: of training.
        picture: size of the room's pictures in pixels, and paths per pixel.
        view_size: pixels along each side of the pictures of the lamp itself.
        reference_seconds: time for the reference of the room, and half of it for the lamp's.
    """

    folder: Path
    lamp: str = "frosted_globe"
    preset: str = "draft"
    picture: room.Picture = ROOM_PICTURE
    view_size: int = 384
    reference_seconds: float = 60.0

    def __call__(self) -> Path:
        """Run every unfinished stage in Mitsuba's current variant; returns the report's path."""
        self.folder.mkdir(parents=True, exist_ok=True)
        run_stages(self.folder, self.stages())
        return self.folder / "report.html"

    def stages(self) -> list[Stage]:
        """The stages in order; each depends on all before it."""
        shown: Figures = {"size": [self.picture.width, self.picture.height]}
        timed: Figures = {"seconds": self.reference_seconds}
        neural, real = self._neural, self._real
        return [
            self._stage("lamp", "Building the lamp", 3, {"lamp": self.lamp, "version": version()},
                        self._build, self.scene.name),
            self._stage("train", f"Training its networks ({self.preset})", 200,
                        {"preset": self.preset}, self._train, "run/metrics.json"),
            self._stage("export", "Exporting lamp.plux", 15, {}, self._export, "lamp.plux",
                        "lamp.usda"),
            self._stage("reference", "Light tracing the real lamp as the reference",
                        self.reference_seconds, shown | timed, real("reference"),
                        "room_reference.exr", demo_report.HALF),
            self._stage("view", "Looking at the lamp itself", 5, {"size": self.view_size},
                        self._view, "lamp_asset.exr"),
            self._stage("view_reference", "Tracing the real lamp itself",
                        self.reference_seconds / 2, {}, self._view_reference,
                        "lamp_reference.exr"),
            self._stage("accurate", "Rendering the room, accurate", 25, {"spp": self.picture.spp},
                        neural("accurate"), "room_accurate.exr"),
            self._stage("fast", "Rendering the room, fast", 75, {}, neural("fast"),
                        "room_fast.exr"),
            self._stage("plain", "Rendering the room with a plain light", 8, {}, self._plain,
                        "room_plain.exr"),
            self._stage("path", "Path tracing the real lamp for the same time", 25, {},
                        real("path"), "room_path.exr"),
            self._stage("report", "Writing the report", 2, {}, self._report, "report.html",
                        demo_report.PAGE),
        ]  # fmt: skip

    @property
    def scene(self) -> Path:
        """The lamp's own scene."""
        return self.folder / "luminaire" / f"{self.lamp}.xml"

    # Stages

    def _build(self, done: dict[str, Record]) -> Figures:
        LAMPS[self.lamp].write(self.scene.parent)
        return {}

    def _train(self, done: dict[str, Record]) -> Figures:
        run = str(self.folder / "run")
        command("purelight-train", train_cli.main, [
            str(self.scene), "--output", run, "--preset", self.preset, "--seed", "0", "--resume",
        ])  # fmt: skip
        metrics = json.loads((self.folder / "run" / "metrics.json").read_text())
        platform.use()  # training on a GPU leaves its variant
        return {"seconds": sum(metrics["seconds"].values())}

    def _export(self, done: dict[str, Record]) -> Figures:
        arguments = [str(self.folder / "run"), "--output", str(self.bundle)]
        command("purelight-export", export_cli.main, arguments)
        return {"bytes": self.bundle.stat().st_size}

    def _neural(self, mode: str) -> Callable[[dict[str, Record]], Figures]:
        def stage(done: dict[str, Record]) -> Figures:
            scene = self._room(NeuralLamp(self.bundle, mode), mode)
            return self._keep(mode, rendering.render(scene, self.picture.spp, mode))

        return stage

    def _plain(self, done: dict[str, Record]) -> Figures:
        scene = self._room(SphereLamp(Bundle.open(self.bundle).manifest.flux), "plain")
        return self._keep("plain", rendering.render(scene, self.picture.spp, "plain"))

    def _real(self, name: str) -> Callable[[dict[str, Record]], Figures]:
        def stage(done: dict[str, Record]) -> Figures:
            same_time = name == "path"
            plugin = "path" if same_time else "ptracer"
            seconds = done["accurate"].figures["seconds"] if same_time else self.reference_seconds
            scene = self._room(RealLamp(self.scene, plugin), name)
            rendered = rendering.render_for(scene, seconds, name)
            if not same_time:
                write_exr(self.folder / demo_report.HALF, rendered.halves[0])
            return self._keep(name, rendered)

        return stage

    def _view(self, done: dict[str, Record]) -> Figures:
        luminaire = Luminaire.open(self.bundle, threads=2)
        image = view(luminaire, self._camera(), samples=16)
        write_exr(self.folder / "lamp_asset.exr", image)
        return {}

    def _view_reference(self, done: dict[str, Record]) -> Figures:
        scene = self.scene.with_name(f"{self.lamp}_view.xml")
        lamp = RealLamp(self.scene, VIEWED_BY[self.lamp])
        write_xml(scene, view_scene(lamp, self._camera()))
        seconds = self.reference_seconds / 2
        traced = rendering.render_for(scene, seconds, "lamp", pass_spp=32)
        write_exr(self.folder / "lamp_reference.exr", traced.image)
        return {"spp": traced.spp, "noise": traced.noise()}

    def _report(self, done: dict[str, Record]) -> Figures:
        lamp = Bundle.open(self.bundle)
        web_page.write(self.folder / demo_report.PAGE, lamp)
        demo_report.write(self.folder, self.lamp, done, lamp.manifest)
        return {}

    # Pieces

    @property
    def bundle(self) -> Path:
        """The exported lamp."""
        return self.folder / "lamp.plux"

    def _stage(
        self, name: str, title: str, expected: float, settings: Figures,
        action: Callable[[dict[str, Record]], Figures], *outputs: str,
    ) -> Stage:  # fmt: skip
        paths = tuple(self.folder / output for output in outputs)
        return Stage(name, title, expected, settings, action, paths)

    def _room(self, lamp: LampChoice, name: str) -> Path:
        return room.write(self.folder / "room", lamp, self.picture, f"room_{name}")

    def _keep(self, name: str, rendered: rendering.Rendering) -> Figures:
        write_exr(self.folder / f"room_{name}.exr", rendered.image)
        return {"seconds": rendered.seconds, "spp": rendered.spp, "noise": rendered.noise()}

    def _camera(self) -> Camera:
        sphere = Bundle.open(self.bundle).manifest.bounding_sphere
        return Camera.orbit(sphere, azimuth=-65.0, elevation=4.0, size=self.view_size)


def command(name: str, main: Callable[[Sequence[str]], int], arguments: list[str]) -> None:
    """Run another command of the family.

    Raises:
        PureLightError: it failed, and has said why.
    """
    code = main(arguments)
    if code:
        raise PureLightError(
            f"{name} stopped with exit code {code}; mend what it says above, then run this again"
        )


def version() -> str:
    """Version of the installed distribution."""
    return metadata.version("purelight")
