"""A USD stage as a Mitsuba scene, with a note of everything that is not rendered as it says."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.usd import asset_layer
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.usd_scene import camera, lights, shapes
from purelight_mitsuba.usd_scene.materials import Materials
from purelight_mitsuba.usd_scene.values import Values

INSTALL = 'pip install "purelight[usd]"'
NOT_RENDERED = {
    "BasisCurves", "NurbsCurves", "NurbsPatch", "HermiteCurves", "TetMesh", "Points", "Volume",
    "PointInstancer", "PortalLight", "GeometryLight", "PluginLight",
}  # fmt: skip
INVISIBLE = ("guide", "proxy")


@dataclass
class UsdScene:
    """A Mitsuba scene and what was left out of it.

    Arguments:
        scene: Ready to render; its sensor is the chosen camera.
        notes: One line for each thing on the stage that is rendered otherwise or not at all.
    """

    scene: mi.Scene
    notes: list[str]


@dataclass
class _Reader:
    """Gathers the parts of a scene while the stage is walked."""

    values: Values
    parts: dict[str, Any] = field(default_factory=lambda: {"type": "scene"})
    notes: list[str] = field(default_factory=list)

    def add(self, kind: str, part: Any) -> None:
        self.parts[f"{kind}_{len(self.parts)}"] = part

    def note(self, prim: Any, text: str) -> None:
        line = f"{prim.GetPath()}: {text}"
        if line not in self.notes:
            self.notes.append(line)


def load_usd(path: Path, *, view: str | None = None, frame: float | None = None) -> UsdScene:
    """Reads a stage: meshes and solids, UsdPreviewSurface, lights, one camera, and luminaires.

    Lengths stay those of the stage. A luminaire is placed by its prim's own transform, so one that
    is referenced into a stage of other units needs the scale that USD asks of every asset.

    Arguments:
        path: A layer that OpenUSD can open.
        view: Path of the camera; the render settings' or else the first by default.
        frame: Time code; the earliest sample of each value by default.

    Raises:
        PureLightError: If the stage cannot be opened or has no such camera, or a lamp is faulty.
    """
    stage = open_stage(path)
    from pxr import Usd

    time = Usd.TimeCode.EarliestTime() if frame is None else Usd.TimeCode(frame)
    reader = _Reader(Values(time))
    lamps = asset_layer.luminaires(stage)
    for lamp in lamps:
        reader.add("lamp", _luminaire(lamp, path))
    hidden = {name for lamp in lamps for name in (*lamp.fallback, *lamp.exit_surface)}
    materials = Materials(reader.values, reader.note)
    for prim in shown(stage, reader.values, hidden):
        _add(prim, reader, materials)
    reader.parts["sensor"] = camera.sensor(stage, reader.values, view, path, reader.note)
    return UsdScene(_load(reader.parts, path), reader.notes)


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
        reason = str(error).strip().splitlines()[-1].strip().strip("'")
        raise PureLightError(f"{path}: OpenUSD cannot read it: {reason[:200]}") from error


def shown(stage: Any, values: Values, hidden: set[str]) -> Iterator[Any]:
    """The prims that are seen, inside instances as well."""
    from pxr import Usd, UsdGeom

    walk = iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in walk:
        imageable = UsdGeom.Imageable(prim)
        if str(prim.GetPath()) in hidden or prim.IsA("PointInstancer"):
            walk.PruneChildren()
        if str(prim.GetPath()) in hidden or not imageable:
            continue
        if imageable.ComputeVisibility(values.time) == UsdGeom.Tokens.invisible:
            walk.PruneChildren()
        elif imageable.ComputePurpose() not in INVISIBLE:
            yield prim


def _add(prim: Any, reader: _Reader, materials: Materials) -> None:
    """Adds what a prim shows, by its type."""
    kind = str(prim.GetTypeName())
    read: dict[str, Callable[[], Iterator[Any]]] = {
        "Mesh": lambda: shapes.mesh(prim, reader.values, materials, reader.note),
        **dict.fromkeys(
            shapes.SOLIDS, lambda: shapes.solid(prim, reader.values, materials, reader.note)
        ),
        **dict.fromkeys(lights.KINDS, lambda: lights.light(prim, reader.values, reader.note)),
    }
    if kind in read:
        for part in read[kind]():
            reader.add(kind, part)
    elif kind in NOT_RENDERED:
        reader.note(prim, f"{kind} is not supported and was left out")


def _luminaire(lamp: asset_layer.LuminairePrim, path: Path) -> dict[str, Any]:
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
    from purelight_mitsuba.output.passes import reason

    try:
        return mi.load_dict(parts)
    except RuntimeError as error:
        raise PureLightError(f"{path}: {reason(str(error))}") from error
