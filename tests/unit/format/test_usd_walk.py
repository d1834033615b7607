"""Luminaires and prims of stages that instance them: each where it is, none where it is kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from purelight_format import usd_schema
from purelight_format.errors import PureLightError
from purelight_format.usd.asset_layer import luminaires
from purelight_format.usd.walk import Walk

usd_schema.register()
LAMP = """#usda 1.0
( defaultPrim = "lamp" )
def Xform "lamp" ( apiSchemas = ["PureLightLuminaireAPI"] )
{
    uniform asset purelight:bundle = @./lamp.plux@
    float purelight:dimmer = 1
    rel purelight:fallback = </lamp/f>
    def SphereLight "f"
    {
    }
}
"""


@pytest.fixture
def stage(tmp_path: Path) -> Usd.Stage:
    (tmp_path / "lamp.usda").write_text(LAMP)
    return Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))


def lamp(stage: Usd.Stage, path: str, *, instanceable: bool = False) -> UsdGeom.Xform:
    prim = UsdGeom.Xform.Define(stage, path)
    prim.GetPrim().GetReferences().AddReference("./lamp.usda")
    prim.GetPrim().SetInstanceable(instanceable)
    return prim


def scatter(
    stage: Usd.Stage, path: str, prototypes: list[str], indices: list[int], places: list[tuple]
) -> UsdGeom.PointInstancer:
    instancer = UsdGeom.PointInstancer.Define(stage, path)
    instancer.CreatePrototypesRel().SetTargets(prototypes)
    instancer.CreateProtoIndicesAttr(indices)
    instancer.CreatePositionsAttr(places)
    return instancer


def origins(stage: Usd.Stage, time: Usd.TimeCode | None = None) -> list[list[float]]:
    return sorted(lum.to_world[:3, 3].round(6).tolist() for lum in luminaires(stage, time))


def notes(stage: Usd.Stage) -> list[str]:
    found: list[str] = []
    walk = Walk(stage, Usd.TimeCode.Default(), lambda prim, text: found.append(text))
    assert len(list(walk)) >= 0
    return found


@pytest.mark.parametrize("instanceable", [False, True])
def test_a_point_instancer_places_its_lamps(stage: Usd.Stage, instanceable: bool) -> None:
    instancer = scatter(stage, "/S", ["/S/P/a"], [0, 0, 0], [(1, 0, 0), (2, 0, 0), (3, 0, 0)])
    instancer.AddTranslateOp().Set((0, 0, 5))
    lamp(stage, "/S/P/a", instanceable=instanceable).AddTranslateOp().Set((0, 1, 0))
    stage.GetPrimAtPath("/S/P").SetSpecifier(Sdf.SpecifierOver)
    instancer.CreateOrientationsAttr([Gf.Quath(1, 0, 0, 0)] * 2 + [Gf.Quath(0, 0, 0, 1)])
    instancer.CreateScalesAttr([(1, 1, 1), (2, 2, 2), (1, 1, 1)])
    assert origins(stage) == [[1, 1, 5], [2, 2, 5], [3, -1, 5]]


def test_single_precision_orientations_count_before_half(stage: Usd.Stage) -> None:
    instancer = scatter(stage, "/S", ["/S/a"], [0], [(0, 0, 0)])
    lamp(stage, "/S/a").AddTranslateOp().Set((1, 0, 0))
    instancer.CreateOrientationsAttr([Gf.Quath(1, 0, 0, 0)])
    instancer.CreateOrientationsfAttr([Gf.Quatf(0, 0, 0, 1)])
    assert origins(stage) == [[-1, 0, 0]]


def test_hidden_instances_are_left_out(stage: Usd.Stage) -> None:
    places = [(float(x), 0, 0) for x in range(5)]
    instancer = scatter(stage, "/S", ["/S/a"], [0] * 5, places)
    lamp(stage, "/S/a")
    instancer.CreateIdsAttr([10, 11, 12, 13, 14])
    instancer.CreateInvisibleIdsAttr([11])
    instancer.DeactivateId(13)
    assert origins(stage) == [[0, 0, 0], [2, 0, 0], [4, 0, 0]]


def test_instancers_of_instancers_multiply(stage: Usd.Stage) -> None:
    outer = scatter(stage, "/S", ["/S/in"], [0, 0], [(0, 0, 0), (10, 0, 0)])
    outer.CreateScalesAttr([(1, 1, 1), (2, 2, 2)])
    inner = scatter(stage, "/S/in", ["/S/in/a"], [0, 0], [(0, 1, 0), (0, 2, 0)])
    inner.AddTranslateOp().Set((0, 0, 1))
    lamp(stage, "/S/in/a", instanceable=True)
    assert origins(stage) == [[0, 1, 1], [0, 2, 1], [10, 2, 2], [10, 4, 2]]


def test_instances_hold_lamps_of_their_own_dimmer(stage: Usd.Stage) -> None:
    for k in range(3):
        prim = lamp(stage, f"/L{k}", instanceable=True)
        prim.AddTranslateOp().Set((k, 0, 0))
        prim.GetPrim().GetAttribute("purelight:dimmer").Set(k + 1.0)
    assert [lum.dimmer for lum in luminaires(stage)] == [1, 2, 3]


def test_lamps_deep_in_instances_are_found_at_each(stage: Usd.Stage) -> None:
    lamp(stage, "/Asset/arm/lamp").AddTranslateOp().Set((0, 0, 1))
    stage.GetPrimAtPath("/Asset").SetSpecifier(Sdf.SpecifierOver)
    for k in range(3):
        prim = UsdGeom.Xform.Define(stage, f"/I{k}")
        prim.GetPrim().GetReferences().AddInternalReference("/Asset")
        prim.GetPrim().SetInstanceable(True)
        prim.AddTranslateOp().Set((k, 0, 0))
    assert origins(stage) == [[0, 0, 1], [1, 0, 1], [2, 0, 1]]


@pytest.mark.parametrize("how", ["invisible", "guide", "proxy", "above"])
def test_lamps_that_are_not_shown_are_not_found(stage: Usd.Stage, how: str) -> None:
    UsdGeom.Xform.Define(stage, "/G")
    prim = lamp(stage, "/G/L")
    assert len(luminaires(stage)) == 1
    if how == "above":
        UsdGeom.Imageable(stage.GetPrimAtPath("/G")).MakeInvisible()
    elif how == "invisible":
        UsdGeom.Imageable(prim).GetVisibilityAttr().Set("invisible")
    else:
        UsdGeom.Imageable(prim).CreatePurposeAttr(how)
    assert luminaires(stage) == []


def test_times_are_those_asked_for(stage: Usd.Stage) -> None:
    instancer = scatter(stage, "/S", ["/S/a"], [0], [])
    lamp(stage, "/S/a")
    positions = instancer.GetPositionsAttr()
    positions.Clear()
    positions.Set([(1, 0, 0)], 5)
    positions.Set([(9, 0, 0)], 25)
    instancer.CreateVelocitiesAttr().Set([(24, 0, 0)], 5)
    instancer.GetVelocitiesAttr().Set([(0, 0, 0)], 25)
    moved = lamp(stage, "/L").AddTranslateOp()
    moved.Set((0, 1, 0), 5)
    moved.Set((0, 2, 0), 25)
    assert origins(stage, Usd.TimeCode.EarliestTime()) == [[0, 1, 0], [1, 0, 0]]
    assert origins(stage, Usd.TimeCode(15)) == [[0, 1.5, 0], [11, 0, 0]]  # 24 codes a second.


@pytest.mark.parametrize(
    ("indices", "places", "word"),
    [([0, 7], [(0, 0, 0)] * 2, "no prototype"), ([0, 0], [(0, 0, 0)], "one length")],
)
def test_broken_instancers_are_named(
    stage: Usd.Stage, indices: list[int], places: list[tuple], word: str
) -> None:
    scatter(stage, "/S", ["/S/a"], indices, places)
    lamp(stage, "/S/a")
    assert len(found := notes(stage)) == 1
    assert word in found[0]
    assert luminaires(stage) == []


def test_an_instancer_within_itself_ends(stage: Usd.Stage) -> None:
    scatter(stage, "/S", ["/S/P"], [0, 0], [(0, 0, 0), (1, 0, 0)])
    scatter(stage, "/S/P/T", ["/S"], [0], [(0, 0, 0)])
    assert any("own prototype" in note for note in notes(stage))


def test_an_invisible_prototype_is_named(stage: Usd.Stage) -> None:
    scatter(stage, "/S", ["/P/a"], [0], [(0, 0, 0)])
    lamp(stage, "/P/a")
    UsdGeom.Imageable(UsdGeom.Scope.Define(stage, "/P")).MakeInvisible()
    assert any("/P/a is missing or invisible" in note for note in notes(stage))
    assert luminaires(stage) == []


def test_too_many_instances_are_refused_before_they_are_made(stage: Usd.Stage) -> None:
    many = [(float(x), 0, 0) for x in range(2000)]
    for path, prototype in (("/A", "/A/B"), ("/A/B", "/A/B/C"), ("/A/B/C", "/A/B/C/a")):
        scatter(stage, path, [prototype], [0] * 2000, many)
    lamp(stage, "/A/B/C/a")
    with pytest.raises(PureLightError, match="more than 1,000,000 instances"):
        luminaires(stage)


def materials(stage: Usd.Stage, *paths: str) -> None:
    for path in paths:
        material = UsdShade.Material.Define(stage, f"/Looks{path}")
        prim = stage.GetPrimAtPath(path)
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def spheres(stage: Usd.Stage) -> list[int]:
    """For each time that the walk reads the sphere in the asset, in how many places it is."""
    walk = Walk(stage, Usd.TimeCode.Default())
    return sorted(len(s.places) for s in walk if s.prim.GetTypeName() == "Sphere")


def test_equal_instances_are_read_once(stage: Usd.Stage) -> None:
    UsdGeom.Sphere.Define(stage, "/Asset/ball")
    stage.GetPrimAtPath("/Asset").SetSpecifier(Sdf.SpecifierOver)
    for k in range(4):
        prim = UsdGeom.Xform.Define(stage, f"/G{k}/I").GetPrim()
        prim.GetReferences().AddInternalReference("/Asset")
        prim.SetInstanceable(True)
    assert spheres(stage) == [4]
    materials(stage, "/G0")
    assert spheres(stage) == [1, 3]
    primvars, kind = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/G1")), Sdf.ValueTypeNames
    primvars.CreatePrimvar("displayColor", kind.Color3fArray).Set([(1, 0, 0)])
    assert spheres(stage) == [1, 1, 2]


def test_a_mirrored_and_turned_place_is_kept(stage: Usd.Stage) -> None:
    instancer = scatter(stage, "/S", ["/S/a"], [0], [(1, 2, 3)])
    instancer.CreateScalesAttr([(-1, 1, 1)])
    UsdGeom.Sphere.Define(stage, "/S/a")
    (shown,) = (s for s in Walk(stage, Usd.TimeCode.Default()) if s.prim.GetName() == "a")
    expected = np.diag([-1.0, 1, 1, 1])
    expected[:3, 3] = 1, 2, 3
    np.testing.assert_allclose(shown.to_world(), expected[None])
