"""The USD layer: beside a bundle, first in a bundle, and in stages that others make."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom, UsdLux, UsdValidation

from purelight_format import bundle, usd_schema
from purelight_format.bundle import Bundle
from purelight_format.members.finishes import NONE, Finish
from purelight_format.members.surface import Surface
from purelight_format.usd import layer
from purelight_format.usd.appearance_text import KeptPart
from purelight_format.usd.asset_layer import Paths, identifier, layer_text, luminaires
from purelight_format.usd.guide import guide, likenesses
from tests.support import lamp

usd_schema.register()
PATHS = Paths("./lamp.plux", "./lamp.usda", "ab" * 32, "./lamp.ies")


@pytest.fixture
def asset(tmp_path: Path) -> Path:
    """A bundle with its layer and photometry beside it."""
    manifest, members = lamp.parts()
    written = bundle.write(tmp_path / "lamp.plux", manifest, members)
    (tmp_path / "lamp.ies").write_bytes(members["photometry.ies"])
    paths = replace(PATHS, digest=written.digest)
    path = tmp_path / "lamp.usda"
    path.write_text(layer_text(manifest, lamp.surface(), paths))
    return path


@pytest.fixture
def stage(asset: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(asset))


def faults(path: Path) -> list[str]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    return [f"{error.GetIdentifier()}: {error.GetMessage()}" for error in found]


def test_the_layer_has_no_fault_for_usd(asset: Path) -> None:
    assert faults(asset) == []


def test_finishes_are_no_fault_for_usd(asset: Path) -> None:
    manifest, surface = lamp.parts()[0], lamp.surface()
    painted = replace(manifest, finishes=(Finish("paint", (0.5, 0.5, 0.5)),))
    finish = np.zeros((len(surface.triangles), 2), np.uint8)
    finish[0] = NONE
    text = layer_text(painted, replace(surface, finish=finish), PATHS)
    asset.write_text(text)
    assert faults(asset) == []
    assert not list(layer.check(text.encode(), asset.name, {"lamp.plux", "lamp.ies"}))


def test_the_check_for_faults_can_fail(asset: Path) -> None:
    (asset.parent / "lamp.plux").unlink()
    assert any("lamp.plux" in fault for fault in faults(asset))


def test_the_bundle_under_another_name_is_a_usd_package(asset: Path) -> None:
    package = asset.with_name("copy.usdz")
    shutil.copy(asset.with_name("lamp.plux"), package)
    kinds = {fault.split(":")[1] for fault in faults(package)}
    assert kinds == {"FileExtensionValidator.UnsupportedFileExtensionInPackage"}
    found = luminaires(Usd.Stage.Open(str(package)))
    assert [lum.bundle for lum in found] == [f"{package}[manifest.json]"]


def test_the_package_shows_the_fallback_light_and_the_mesh(asset: Path) -> None:
    package = asset.with_name("copy.usdz")
    shutil.copy(asset.with_name("lamp.plux"), package)
    stage = Usd.Stage.Open(str(package))
    root = stage.GetDefaultPrim()
    light = UsdLux.SphereLight(root.GetChild("fallback"))
    assert light
    assert light.GetIntensityAttr().Get() > 0
    table = UsdLux.ShapingAPI(light.GetPrim()).GetShapingIesFileAttr().Get()
    assert table.resolvedPath == f"{package}[photometry.ies]"
    mesh = UsdGeom.Mesh(root.GetChild("exit_surface"))
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(), lamp.surface().positions)
    assert UsdGeom.Imageable(mesh).ComputeVisibility() == UsdGeom.Tokens.inherited
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.guide])
    box = cache.ComputeWorldBound(mesh.GetPrim()).ComputeAlignedRange()
    np.testing.assert_allclose(box.GetMidpoint(), lamp.SPHERE.center, atol=1e-6)


def test_the_layer_says_what_the_manifest_says(stage: Usd.Stage) -> None:
    prim = stage.GetDefaultPrim()
    assert prim.HasAPI("PureLightLuminaireAPI")
    assert Usd.ModelAPI(prim).GetKind() == "component"
    assert tuple(prim.GetAttribute("purelight:flux").Get()) == lamp.FLUX
    sphere = prim.GetAttribute("purelight:boundingSphere").Get()
    np.testing.assert_allclose(sphere, (*lamp.SPHERE.center, lamp.SPHERE.radius), rtol=1e-7)
    mesh = UsdGeom.Mesh(prim.GetChild("exit_surface"))
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(), lamp.surface().positions)
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    np.testing.assert_array_equal(indices, lamp.surface().triangles)


def test_every_property_is_one_of_the_schema(stage: Usd.Stage) -> None:
    prim = stage.GetDefaultPrim()
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition("PureLightLuminaireAPI")
    ours = {p.GetName() for p in prim.GetAuthoredProperties() if ":" in p.GetName()}
    assert ours == set(definition.GetPropertyNames())
    for name in ours:
        assert not prim.GetProperty(name).IsCustom()
        attribute = definition.GetSchemaAttributeSpec(name)
        if attribute:
            assert prim.GetAttribute(name).GetTypeName() == attribute.typeName


def test_the_fallback_emits_the_flux(stage: Usd.Stage) -> None:
    light = UsdLux.SphereLight(stage.GetPrimAtPath("/octahedron/fallback"))
    radius = light.GetRadiusAttr().Get()
    radiance = light.GetIntensityAttr().Get() * np.array(light.GetColorAttr().Get())
    np.testing.assert_allclose(4 * np.pi**2 * radius**2 * radiance, lamp.FLUX, rtol=1e-6)
    assert radius < lamp.SPHERE.radius
    assert not light.GetNormalizeAttr().Get()
    assert light.GetPrim().HasAPI(UsdLux.ShapingAPI)


def test_a_dark_lamp_and_one_without_photometry_are_written() -> None:
    manifest = replace(lamp.parts()[0], flux=(0.0, 0.0, 0.0), channels=(False,) * 3)
    text = layer_text(manifest, lamp.surface(), replace(PATHS, photometry=""))
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(text)
    light = UsdLux.SphereLight(stage.GetPrimAtPath("/octahedron/fallback"))
    assert light.GetIntensityAttr().Get() == 0
    assert "ies" not in text


@pytest.mark.parametrize("name", ['a "lamp"', "back\\slash", "Lämpchen @ #1", "1st", "'''", "."])
def test_any_name_makes_a_sound_layer(name: str) -> None:
    text = layer_text(replace(lamp.parts()[0], name=name), lamp.surface(), PATHS)
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(text)
    prim = stage.GetDefaultPrim()
    assert Usd.ModelAPI(prim).GetAssetName() == name
    assert prim.GetName() == identifier(name)
    present = {"lamp.plux", "lamp.usda", "lamp.ies"}
    assert not list(layer.check(text.encode(), "lamp.usda", present))


def test_the_layer_names_its_neighbours_only(asset: Path) -> None:
    named = set(re.findall("@([^@]*)@", asset.read_text()))
    assert named == {"./lamp.plux", "./lamp.usda", "./lamp.ies"}


def scene_with_two(asset: Path) -> Path:
    """A scene that references the lamp twice, once as an instance."""
    scene = asset.with_name("scene.usda")
    stage = Usd.Stage.CreateNew(str(scene))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    room = UsdGeom.Xform.Define(stage, "/room").GetPrim()
    Usd.ModelAPI(room).SetKind("assembly")
    stage.SetDefaultPrim(room)
    for name, instanceable in (("one", False), ("two", True)):
        prim = UsdGeom.Xform.Define(stage, f"/room/{name}")
        prim.GetPrim().GetReferences().AddReference("./lamp.usda")
        prim.GetPrim().SetInstanceable(instanceable)
        prim.AddTranslateOp().Set((1, 2, 3))
        prim.AddScaleOp().Set((2, 2, 2))
        prim.GetPrim().GetAttribute("purelight:dimmer").Set(0.25)
    stage.Save()
    return scene


def test_a_scene_with_luminaires_has_no_fault_for_usd(asset: Path) -> None:
    assert faults(scene_with_two(asset)) == []


def test_a_scene_places_luminaires(asset: Path) -> None:
    found = luminaires(Usd.Stage.Open(str(scene_with_two(asset))))
    assert [lum.path for lum in found] == ["/room/one", "/room/two"]
    digest = Bundle.open(asset.with_name("lamp.plux")).digest
    for lum in found:
        assert (Path(lum.bundle), lum.digest) == (asset.with_name("lamp.plux"), digest)
        assert lum.dimmer == 0.25
        np.testing.assert_allclose(lum.to_world @ [1, 1, 1, 1], [3, 4, 5, 1])
        assert lum.fallback == (f"{lum.path}/fallback",)
        assert lum.exit_surface == (f"{lum.path}/exit_surface",)


@pytest.mark.parametrize("moment", ["early", "late", "never", "environment"])
def test_luminaires_are_found_whenever_the_schema_is_registered(asset: Path, moment: str) -> None:
    """A process builds its registry of schemas once, so each case has its own."""
    script = (
        "import sys; from pxr import Usd; from purelight_format import usd_schema\n"
        "from purelight_format.usd import asset_layer\n"
        "if sys.argv[2] == 'early': usd_schema.register()\n"
        "stage = Usd.Stage.Open(sys.argv[1])\n"
        "if sys.argv[2] == 'late': usd_schema.register()\n"
        "found = asset_layer.luminaires(stage)\n"
        "print(len(found), found[0].dimmer, stage.GetDefaultPrim().HasAPI(usd_schema.SCHEMA))\n"
    )
    command = [sys.executable, "-c", script, str(asset), moment]
    folder = {"PXR_PLUGINPATH_NAME": str(usd_schema.DIRECTORY)} if moment == "environment" else {}
    environment = {**os.environ, **folder}
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    assert done.stdout.split() == ["1", "1.0", str(moment in ("early", "environment"))]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Filament bulb", "filament_bulb"),
        ("1st", "lamp_1st"),
        ("ü", "lamp"),
        ("A" * 90, "a" * 40),
        ("Aux", "lamp_aux"),
        ("COM1", "lamp_com1"),
        ("Aux lamp", "aux_lamp"),
    ],
)
def test_names_become_identifiers(name: str, expected: str) -> None:
    assert identifier(name) == expected


def large(finish: np.ndarray | None) -> Surface:
    """A ball of 81,920 triangles."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.1)
    faces = ball.faces.astype(np.uint32)
    return Surface(
        ball.vertices.astype(np.float32), faces, np.ones(faces.shape, np.float32), finish
    )


def test_the_mesh_of_a_large_surface_is_coarse_and_in_its_place() -> None:
    surface = large(None)
    found = guide(surface)
    assert 500 < len(found.triangles) <= 2000
    assert np.linalg.norm(found.positions, axis=1) == pytest.approx(0.1, rel=0.02)
    manifest, _ = lamp.parts()
    text = layer_text(manifest, surface, PATHS).encode()
    assert len(text) < 200_000
    assert not list(layer.check(text, "lamp.usda", {"lamp.plux", "lamp.ies"}))


def test_a_coarse_mesh_keeps_its_finishes() -> None:
    surface = large(None)
    upper = surface.positions[surface.triangles][..., 2].mean(1) > 0
    finish = np.stack([upper, upper], 1).astype(np.uint8)
    found = guide(replace(surface, finish=finish))
    assert 2000 < len(found.triangles) <= 8_000
    height = found.positions[found.triangles][..., 2].mean(1)
    assert found.finish is not None
    far = np.abs(height) > 0.005
    np.testing.assert_array_equal(found.finish[far, 0] == 1, height[far] > 0)


def test_kept_parts_of_many_triangles_have_coarse_likenesses_together() -> None:
    balls = [trimesh.creation.icosphere(subdivisions=k, radius=r) for k, r in ((5, 0.2), (6, 0.1))]
    parts = [
        KeptPart("ball", np.asarray(b.vertices, np.float32), np.asarray(b.faces, np.uint32),
                 np.asarray(b.vertices, np.float32), Finish("paint", (0.5, 0.5, 0.5)))
        for b in balls
    ]  # fmt: skip
    found = likenesses(parts)
    assert sum(len(part.triangles) for part in found) <= 2000
    for part, ball in zip(found, balls, strict=True):
        assert part.normals is None
        assert trimesh.Trimesh(part.positions, part.triangles).area == pytest.approx(
            ball.area, rel=0.1
        )
    assert likenesses(found) == found


def test_a_small_surface_is_its_own_guide() -> None:
    assert guide(lamp.surface()) is not None
    np.testing.assert_array_equal(guide(lamp.surface()).triangles, lamp.surface().triangles)
