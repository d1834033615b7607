"""OpenUSD, in any of its files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.usd.walk import Shown, Walk
from purelight_import.model import limits
from purelight_import.model.frame import UP, Frame
from purelight_import.model.lamp import Lamp
from purelight_import.model.mesh import Mesh
from purelight_import.read.build import Builder
from purelight_import.read.usd_lights import KINDS, add_light, mesh_light
from purelight_import.read.usd_materials import Materials, Surface
from purelight_mitsuba import platform
from purelight_mitsuba.usd_scene import shapes
from purelight_mitsuba.usd_scene.corners import Corners
from purelight_mitsuba.usd_scene.values import Values


def read_usd(path: Path) -> Lamp:
    """Reads the meshes, solids, materials and lights of a stage.

    Raises:
        PureLightError: something about it cannot be taken, with the remedy.
        ValueError: it is broken.
    """
    from pxr import Usd, UsdGeom

    platform.use()  # Lights with a shaping are plugins, which belong to a variant
    from purelight_mitsuba.usd_scene import stage

    opened = stage.open_stage(path)
    _only_beside(opened, path)
    builder = Builder()

    def note(prim: Any, text: str) -> None:
        builder.notes(text, prim.GetName())

    values = Values(Usd.TimeCode.EarliestTime(), note)
    materials = Materials(values, builder.notes, path)
    for number, shown in enumerate(Walk(opened, values.time, note)):
        if number > limits.NODES:
            raise PureLightError(f"{path}: more than {limits.NODES:,} prims; export the lamp alone")
        _add(shown, values, materials, builder, note)
    axis = str(UsdGeom.GetStageUpAxis(opened)).lower()
    stated = UsdGeom.StageHasAuthoredMetersPerUnit(opened)
    if not stated:
        builder.notes("the stage states no unit, which in USD means centimetres (--units)")
    metres = float(UsdGeom.GetStageMetersPerUnit(opened))
    frame = Frame(metres if metres > 0 else 0.01, axis if axis in UP else "y")
    return Lamp(_title(opened), tuple(builder.parts), (), frame, builder.notes,
                tuple(builder.room))  # fmt: skip


def _only_beside(opened: Any, path: Path) -> None:
    """Refuses a stage of which parts lie outside its folder.

    Raises:
        PureLightError: they do.
    """
    from pxr import Ar

    root = path.resolve().parent
    for layer in opened.GetUsedLayers():
        if layer.anonymous or not layer.realPath:
            continue
        file = Path(Ar.SplitPackageRelativePathOuter(layer.realPath)[0]).resolve()
        if not file.is_relative_to(root):
            raise PureLightError(f"{path}: its layer {file.name} lies outside the lamp's folder")


def _title(opened: Any) -> str:
    prim = opened.GetDefaultPrim()
    if not prim:
        return ""
    return str(prim.GetMetadata("displayName") or prim.GetName())


def _add(
    shown: Shown, values: Values, materials: Materials, builder: Builder, note: shapes.Note
) -> None:
    """Adds what a prim shows, by its type, at all places where it is."""
    from purelight_mitsuba.usd_scene.stage import NOT_RENDERED

    prim, kind = shown.prim, str(shown.prim.GetTypeName())
    if kind in shapes.KINDS:
        own, copies = values.within(shown.space), len(shown.places)
        for bound, corners in shapes.shapes(prim, own, materials, note, copies):
            builder.foresee(copies * len(corners.face), copies)
            for place in shown.places:
                _add_part(prim, bound, corners.under(place), materials, builder)
    elif kind in KINDS:
        for place in shown.places:
            add_light(prim, values.within(shown.space, place), builder)
    elif kind in NOT_RENDERED:
        builder.notes(f"{kind} is left out", prim.GetName())


def _add_part(
    prim: Any, bound: Any, corners: Corners, materials: Materials, builder: Builder
) -> None:
    surface: Surface = materials.surface(bound, prim)
    two_sided = bool(materials.values.get(prim, "doubleSided", False))
    path = tuple(_names(prim))
    name = prim.GetName() if bound == prim else f"{prim.GetName()}_{bound.GetName()}"
    if _general(name) and len(path) > 1:
        name = path[-2]
    mesh, radiance = mesh_of(corners), surface.radiance
    if "MeshLightAPI" in prim.GetAppliedSchemas():
        radiance = mesh_light(prim, materials.values, mesh.area) or radiance
    builder.add(name, mesh, surface.material, path, radiance, double_sided=two_sided)


def _general(name: str) -> bool:
    """Whether a name says nothing, as exporters call every mesh."""
    return name.lower() in ("mesh", "geometry", "shape", "geom", "object")


def _names(prim: Any) -> Iterator[str]:
    return (part for part in str(prim.GetPath()).split("/") if part)


def mesh_of(corners: Corners) -> Mesh:
    """Triangles whose equal corners share a vertex."""
    columns = [corners.position.reshape(-1, 3)]
    if corners.normal is not None:
        columns.append(corners.normal.reshape(-1, 3))
    if corners.uv is not None:
        columns.append(corners.uv.reshape(-1, 2))
    rows, index = np.unique(np.concatenate(columns, 1), axis=0, return_inverse=True)
    normals = rows[:, 3:6] if corners.normal is not None else None
    uv = rows[:, -2:].copy() if corners.uv is not None else None
    if uv is not None:
        uv[:, 1] = 1 - uv[:, 1]  # The origin of USD's is the lower left corner.
    faces = index.reshape(-1, 3).astype(np.uint32)
    return Mesh(rows[:, :3].astype(np.float64), faces, normals, uv)
