"""The room as a USD stage with three references to a lamp: one dimmed, one scaled, one on a wall.

    python -m purelight_examples.scenes.usd_room --lamp out/demo/lamp.usda --output room.usda

Besides, it shows what rooms from USD have: instances of one bead, scattered by a `PointInstancer`,
cushions that are subdivision surfaces, and a light shaped to a cone above the canvas.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.scenes import room
from purelight_format import atomic, command
from purelight_format.errors import PureLightError

COMMAND = "python -m purelight_examples.scenes.usd_room"
PENDANTS = {
    "Dimmed": ((-0.45, 0.5, 0.5), 1.0, 0.35),
    "Scaled": ((0.45, 0.1, 0.45), 1.6, 1.0),
}  # Place, size and dimmer.
ON_WALL = (0.45, 1.4, 0.3)  # Right of the canvas, in sight of the camera
BEADS, BEAD_PLACE = 40, (0.25, 0.1, -0.73)
CUSHIONS = ((-0.8, 1.0, -0.72), (0.05, 1.0, -0.72))
CUBE = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
SIDES = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]


def write(path: Path, lamp: Path) -> Path:
    """Writes the stage.

    Arguments:
        path: Of the stage, .usda.
        lamp: The USD asset of a lamp, beside its bundle.

    Returns:
        The stage's path.
    """
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Room").GetPrim())
    for part in room.parts():
        if part.name != "cord":  # That of the one lamp that the other room has.
            _mesh(stage, part)
    name = os.path.relpath(lamp.resolve(), path.resolve().parent).replace(os.sep, "/")
    _lamps(stage, name if name.startswith(".") else f"./{name}")
    _beads(stage)
    _cushions(stage)
    _picture_light(stage)
    _camera(stage)
    atomic.write_bytes(path, stage.GetRootLayer().ExportToString().encode())
    return path


def _mesh(stage: Any, part: Part) -> None:
    """A part of the room, in its colour."""
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh.Define(stage, f"/Room/{part.name}")
    faces = np.asarray(part.mesh.faces)
    mesh.CreatePointsAttr(np.asarray(part.mesh.vertices, np.float32))
    mesh.CreateFaceVertexCountsAttr(np.full(len(faces), 3, np.int32))
    mesh.CreateFaceVertexIndicesAttr(faces.ravel().astype(np.int32))
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDisplayColorAttr([next(iter(part.material.colors.values()))])


def _lamps(stage: Any, asset: str) -> None:
    """Three references to the lamp; the networks are loaded once."""
    for name, (place, scale, dimmer) in PENDANTS.items():
        lamp = _lamp(stage, name, asset, place)
        lamp.AddScaleOp().Set((scale,) * 3)
        lamp.GetPrim().GetAttribute("purelight:dimmer").Set(dimmer)
    _lamp(stage, "OnWall", asset, ON_WALL).AddRotateXOp().Set(-90.0)  # Its top to the wall.


def _lamp(stage: Any, name: str, asset: str, place: Sequence[float]) -> Any:
    from pxr import Sdf, UsdGeom

    lamp = UsdGeom.Xform.Define(stage, f"/Room/{name}")
    lamp.GetPrim().GetReferences().AddReference(asset)
    lamp.GetPrim().CreateAttribute("purelight:dimmer", Sdf.ValueTypeNames.Float, custom=False)
    lamp.AddTranslateOp().Set(tuple(place))
    return lamp


def _beads(stage: Any) -> None:
    """Beads on the table, instances of one."""
    from pxr import UsdGeom

    beads = UsdGeom.PointInstancer.Define(stage, "/Room/Beads")
    bead = UsdGeom.Sphere.Define(stage, "/Room/Beads/Bead")
    bead.CreateRadiusAttr(0.018)
    bead.CreateDisplayColorAttr([(0.5, 0.3, 0.08)])
    angle = np.arange(BEADS) * np.pi * (3 - 5**0.5)
    reach = 0.34 * np.sqrt((np.arange(BEADS) + 8) / (BEADS + 8))
    place = np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(BEADS)], 1)
    beads.CreatePrototypesRel().SetTargets([bead.GetPath()])
    beads.CreateProtoIndicesAttr(np.zeros(BEADS, np.int32))
    beads.CreatePositionsAttr((place + BEAD_PLACE).astype(np.float32))


def _cushions(stage: Any) -> None:
    """Cubes, made soft by Catmull and Clark, on the sofa."""
    from pxr import UsdGeom

    for k, place in enumerate(CUSHIONS):
        cushion = UsdGeom.Mesh.Define(stage, f"/Room/Cushion{k}")
        cushion.CreatePointsAttr(np.array(CUBE, np.float32))
        cushion.CreateFaceVertexCountsAttr([4] * 6)
        cushion.CreateFaceVertexIndicesAttr(SIDES)
        cushion.CreateSubdivisionSchemeAttr("catmullClark")
        edge = [1, 5, 7, 3, 1, 0, 4, 6, 2, 0]
        cushion.CreateCreaseIndicesAttr(edge)
        cushion.CreateCreaseLengthsAttr([len(edge)])
        cushion.CreateCreaseSharpnessesAttr([1.5])
        cushion.CreateDisplayColorAttr([(0.75, 0.6, 0.25)])
        cushion.AddTranslateOp().Set(place)
        cushion.AddRotateXYZOp().Set((65.0, 0.0, 12.0 - 24.0 * k))
        cushion.AddScaleOp().Set((0.2, 0.2, 0.08))


def _picture_light(stage: Any) -> None:
    """A small light above the canvas, shaped to a cone."""
    from pxr import UsdLux

    light = UsdLux.SphereLight.Define(stage, "/Room/PictureLight")
    light.CreateRadiusAttr(0.01)
    light.CreateIntensityAttr(120.0)
    light.CreateColorAttr((1.0, 0.6, 0.3))
    light.AddTranslateOp().Set((-0.3, 1.15, 0.95))
    light.AddRotateXOp().Set(28.0)
    shaping = UsdLux.ShapingAPI.Apply(light.GetPrim())
    shaping.CreateShapingConeAngleAttr(32.0)
    shaping.CreateShapingConeSoftnessAttr(0.4)


def _camera(stage: Any) -> None:
    """That of the other room."""
    from pxr import Gf, UsdGeom

    camera = UsdGeom.Camera.Define(stage, "/Room/Camera")
    camera.CreateHorizontalApertureAttr(24.0)
    camera.CreateVerticalApertureAttr(18.0)
    camera.CreateFocalLengthAttr(float(12 / np.tan(np.radians(room.FOV) / 2)))
    camera.CreateClippingRangeAttr((0.01, 100.0))
    eye, target = Gf.Vec3d(*room.CAMERA), Gf.Vec3d(*room.TARGET)
    view = Gf.Matrix4d().SetLookAt(eye, target, Gf.Vec3d(0, 0, 1))
    camera.AddTransformOp().Set(view.GetInverse())


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _act(_parser().parse_args(argv)))


def _act(options: argparse.Namespace) -> int:
    if not options.lamp.is_file():
        raise PureLightError(f"{options.lamp}: no such file; purelight-export writes a lamp.usda")
    atomic.check_file(options.output)
    print(write(options.output, options.lamp))
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--lamp", type=Path, required=True, help="its USD asset, lamp.usda")
    parser.add_argument("--output", type=Path, required=True, help="the stage to write, .usda")
    return parser


if __name__ == "__main__":
    sys.exit(main())
