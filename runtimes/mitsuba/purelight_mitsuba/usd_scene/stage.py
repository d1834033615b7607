"""A USD stage as a Mitsuba scene, with a note of everything that is not rendered as it says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.usd.luminaires import LuminairePrim, luminaires_of
from purelight_format.usd.walk import Shown, Walk
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.platform import reading
from purelight_mitsuba.scene_file import reason
from purelight_mitsuba.usd_scene import camera, lights, shapes
from purelight_mitsuba.usd_scene.materials import Materials
from purelight_mitsuba.usd_scene.meshes import Meshes
from purelight_mitsuba.usd_scene.values import Values

INSTALL = 'pip install "purelight[usd]"'
NOT_RENDERED = {
    "BasisCurves", "NurbsCurves", "NurbsPatch", "HermiteCurves", "TetMesh", "Points", "Volume",
    "PortalLight", "GeometryLight", "PluginLight", "Capsule_1", "Cylinder_1",
}  # fmt: skip
NO_LIGHTS = {"MeshLightAPI", "VolumeLightAPI"}  # Applied to what is no light by its type


@dataclass
class UsdScene:
    """A Mitsuba scene and what was left out of it.

    Arguments:
        scene: Ready to render; its sensor is the chosen camera.
        notes: One line for each thing on the stage that is rendered otherwise or not at all.
    """

    scene: mi.Scene
    notes: list[str]


class _Notes(dict[str, None]):
    """Lines of what is rendered otherwise than a stage says, each once."""

    def __call__(self, prim: Any, text: str) -> None:
        self[f"{prim.GetPath()}: {text}"] = None


@dataclass
class _Reader:
    """Gathers the parts of a scene while the stage is walked.

    Nothing that it holds may hold it: its parts would outlive the scene until Python looks for
    cycles, and Mitsuba's calls of all emitters fail at one whose shape is gone.
    """

    time: Any
    path: Path
    parts: dict[str, Any] = field(default_factory=lambda: {"type": "scene"})
    note: _Notes = field(default_factory=_Notes)

    def __post_init__(self) -> None:
        self.values = Values(self.time, self.note)
        self._materials = Materials(self.values, self.note)
        self._meshes = Meshes(self._materials)

    def add(self, shown: Shown) -> None:
        """Adds what a prim shows, by its type."""
        kind = str(shown.prim.GetTypeName())
        for lamp in luminaires_of(shown, self.time):
            self._put("lamp", _luminaire(lamp, self.path))
        if kind in shapes.KINDS:
            parts: Iterator[Any] = self._shapes(shown)
        elif kind in lights.KINDS:
            parts = self._lights(shown)
        else:
            parts = iter(())
            if kind in NOT_RENDERED:
                self.note(shown.prim, f"{kind} is not supported and was left out")
        for part in parts:
            self._put(kind, part)
        for schema in sorted(NO_LIGHTS & set(shown.prim.GetAppliedSchemas())):
            self.note(shown.prim, f"{schema} is not supported; rendered without its light")

    def _put(self, kind: str, part: Any) -> None:
        self.parts[f"{kind}_{len(self.parts)}"] = part

    def _shapes(self, shown: Shown) -> Iterator[mi.Mesh]:
        values, copies = self.values.within(shown.space), len(shown.places)
        found = shapes.shapes(shown.prim, values, self._materials, self.note, copies)
        for bound, corners in found:
            yield from self._meshes.of(shown.prim, bound, corners, shown.places)

    def _lights(self, shown: Shown) -> Iterator[Any]:
        for place in shown.places:
            values = self.values.within(shown.space, place)
            for light in lights.light(shown.prim, values, self.note):
                if light["type"] in lights.AROUND:
                    self._surround(shown.prim, light)
                else:
                    yield light

    def _surround(self, prim: Any, light: dict[str, Any]) -> None:
        """Adds light from all around, of which Mitsuba has one emitter."""
        both = lights.together(self.parts.get("around"), light)
        if both is None:
            self.note(prim, "a second dome light with a texture; left out")
        else:
            self.parts["around"] = both


@reading()
def load_usd(
    path: Path, *, view: str | None = None, frame: float | None = None,
    pixel_filter: str = "gaussian",
) -> UsdScene:  # fmt: skip
    """Reads a stage: meshes and solids, UsdPreviewSurface, lights, one camera, and luminaires.

    Lengths stay those of the stage. A luminaire is placed by its prim's own transform, so one that
    is referenced into a stage of other units needs the scale that USD asks of every asset.

    Arguments:
        path: A layer that OpenUSD can open.
        view: Path of the camera; the render settings' or else the first by default.
        frame: Time code; the earliest sample of each value by default.
        pixel_filter: Mitsuba's reconstruction filter; `box` for a denoiser.

    Raises:
        PureLightError: If the stage cannot be opened or has no such camera, or a lamp is faulty.
    """
    stage = open_stage(path)
    from pxr import Usd

    time = Usd.TimeCode.EarliestTime() if frame is None else Usd.TimeCode(frame)
    reader = _Reader(time, path)
    for shown in Walk(stage, time, reader.note):
        reader.add(shown)
    reader.parts["sensor"] = camera.sensor(
        stage, reader.values, view, path, reader.note, pixel_filter
    )
    return UsdScene(_load(reader.parts, path), list(reader.note))


def open_stage(path: Path) -> Any:
    """Opens a stage.

    Raises:
        PureLightError: If OpenUSD is missing or cannot read it.
    """
    try:
        from pxr import Tf, Usd
    except ImportError as error:
        raise PureLightError(f"{path}: needs OpenUSD ({error}); {INSTALL}") from error
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        first = str(getattr(error.args[0], "commentary", error.args[0]))  # the others follow of it
        reason = " ".join(first.split()).removeprefix(f"{path.resolve()}:")
        raise PureLightError(f"{path}: OpenUSD cannot read it: {reason[:200]}") from error


def _luminaire(lamp: LuminairePrim, path: Path) -> dict[str, Any]:
    """The emitter `purelight` for a luminaire's prim.

    Raises:
        PureLightError: If its bundle is missing, or another than the asset was written for.
    """
    bundle = Path(lamp.bundle) if Path(lamp.bundle).is_absolute() else path.parent / lamp.bundle
    if not lamp.bundle or not bundle.is_file():
        raise PureLightError(f"{path}: {lamp.path}: its bundle {lamp.bundle!r} cannot be found")
    if lamp.digest and load(bundle).digest != lamp.digest:
        raise PureLightError(
            f"{path}: {lamp.path}: {bundle} is not the bundle that its USD asset was written for; "
            "export both again"
        )
    return {
        "type": "purelight",
        "filename": str(bundle),
        "dimmer": lamp.dimmer,
        "to_world": mi.ScalarTransform4f(np.ascontiguousarray(lamp.to_world)),
    }


def _load(parts: dict[str, Any], path: Path) -> mi.Scene:
    try:
        return mi.load_dict(parts)
    except RuntimeError as error:
        raise PureLightError(f"{path}: {reason(str(error))}") from error
