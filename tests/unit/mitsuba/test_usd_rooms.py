"""Stages as others make them: instances, subdivision surfaces, textures, shaped lights."""

from __future__ import annotations

import gc
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba.lamps import luminaire
from purelight_mitsuba.usd_scene import load_usd, meshes
from purelight_onnx.picture import write_exr
from tests.support import analytic_lamps as lamps
from tests.support.usd_stages import FLOOR, LIGHT, RAW, UPRIGHT, first_hit, loaded, stage, textured

# Instances

SCATTER = """
def PointInstancer "S"
{{
    rel prototypes = [</S/P/Ball>, </S/P/Box>]
    int[] protoIndices = [0, 1, 0]
    point3f[] positions = [(-1, 0, 0), (0, 0, 0), (1, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 1, 1), (-2, 1, 1)]
    over "P"
    {{
        def Sphere "Ball"
        {{
            double radius = 0.25
            {more}
        }}
        def Cube "Box"
        {{
            double size = 0.5
        }}
    }}
}}
"""


def test_a_point_instancer_shows_its_prototypes_where_they_are_instanced(tmp_path: Path) -> None:
    found = loaded(tmp_path, SCATTER.format(more=""))
    assert found.notes == []
    scene = found.scene
    assert len(scene.shapes()) == 2
    ball = scene.shapes()[0].bbox()
    np.testing.assert_allclose([ball.min.x, ball.max.x, ball.max.z], [-1.25, 1.5, 0.25], atol=1e-3)
    for x, z in ((-1, 0.25), (0, 0.25), (1, 0.25)):  # 90 degrees see 4 m.
        hit = first_hit(scene, 0.5 + x / 4 * (4 / (4 - z)), 0.5)
        np.testing.assert_allclose(np.array(hit.p).ravel(), [x, 0, z], atol=2e-3)
        np.testing.assert_allclose(np.array(hit.n).ravel(), [0, 0, 1], atol=0.05)


def test_reflected_copies_face_outwards(tmp_path: Path) -> None:
    scene = loaded(tmp_path, SCATTER.format(more="")).scene
    eye = mi.Ray3f(mi.Point3f(0, 0.05, 3), mi.Vector3f(1.02 / 3, 0, -1))
    hit = scene.ray_intersect(eye)
    assert float(dr.dot(hit.n, eye.d)[0]) < 0
    assert float(dr.dot(hit.sh_frame.n, eye.d)[0]) < 0


def test_lights_and_lamps_of_an_instancer_shine_at_each_instance(tmp_path: Path) -> None:
    lamps.ball().write(tmp_path / "ball.plux")
    prim = """
def PointInstancer "S"
{
    rel prototypes = [</S/Lamp>, </S/Light>]
    int[] protoIndices = [0, 0, 1]
    point3f[] positions = [(1, 0, 0), (2, 0, 0), (0, 3, 0)]
    def Xform "Lamp" ( apiSchemas = ["PureLightLuminaireAPI"] )
    {
        uniform asset purelight:bundle = @./ball.plux@
        rel purelight:fallback = </S/Lamp/Stand_in>
        def SphereLight "Stand_in"
        {
        }
    }
    def SphereLight "Light"
    {
    }
}
"""
    scene = loaded(tmp_path, prim).scene
    ours = [e for e in scene.emitters() if hasattr(e, "luminaire")]
    places = sorted(np.array(e.to_world.matrix).reshape(4, 4)[:3, 3].tolist() for e in ours)
    np.testing.assert_allclose(places, [[1, 0, 0], [2, 0, 0]])
    (light,) = scene.shapes()
    np.testing.assert_allclose(np.array(light.bbox().center()).ravel(), [0, 3, 0], atol=1e-6)
    assert len(scene.emitters()) == 3


MANY = 200
LAMP = """def Xform "{name}" ( {more} apiSchemas = ["PureLightLuminaireAPI"] )
{{
    uniform asset purelight:bundle = @./ball.plux@
}}
"""
GRID = ", ".join(f"({k % 20}, {k // 20}, 0)" for k in range(MANY))
SCATTERED = f"""def PointInstancer "S"
{{
    rel prototypes = [</S/Lamp>]
    int[] protoIndices = [{", ".join(["0"] * MANY)}]
    point3f[] positions = [{GRID}]
    {LAMP.format(name="Lamp", more="")}
}}
"""
REFERENCED = "".join(
    f'def "L{k}" ( {more} references = </Asset> )\n{{\n}}\n'
    for k in range(MANY)
    for more in ("instanceable = true;" if k % 2 else "",)
)


@pytest.mark.parametrize("prims", ["apart", "references", "instancer"])
def test_many_lamps_hold_one_copy_of_the_networks(
    tmp_path: Path, prims: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(luminaire, "_by_file", {})
    lamps.ball().write(tmp_path / "ball.plux")
    text = {
        "apart": "".join(LAMP.format(name=f"L{k}", more="") for k in range(MANY)),
        "references": LAMP.format(name="Asset", more="").replace("def", "class", 1) + REFERENCED,
        "instancer": SCATTERED,
    }[prims]
    before = _loaded_lamps()
    emitters = loaded(tmp_path, text).scene.emitters()
    assert len(emitters) == MANY
    copies = _loaded_lamps() - before
    assert copies == {id(emitters[0].luminaire)}
    assert all(e.luminaire is emitters[0].luminaire for e in emitters)


def _loaded_lamps() -> set[int]:
    """Identities of all lamps' networks in this process."""
    gc.collect()
    return {id(o) for o in gc.get_objects() if isinstance(o, luminaire.Luminaire)}


INSTANCES = """
over "Asset"
{{
    def Sphere "Ball"
    {{
        double radius = 0.3
    }}
}}
def Xform "A" ( instanceable = true
    references = </Asset> )
{{
    double3 xformOp:translate = (-1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Xform "B" ( instanceable = true
    references = </Asset> )
{{
    double3 xformOp:translate = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {color}
}}
"""


def test_instances_are_one_mesh_unless_they_look_different(tmp_path: Path) -> None:
    (one,) = loaded(tmp_path, INSTANCES.format(color="")).scene.shapes()
    np.testing.assert_allclose([one.bbox().min.x, one.bbox().max.x], [-1.3, 1.3], atol=1e-3)
    red = 'color3f[] primvars:displayColor = [(0.8, 0, 0)] ( interpolation = "constant" )'
    scene = loaded(tmp_path, INSTANCES.format(color=red)).scene
    colors = [
        np.array(hit.bsdf().eval_diffuse_reflectance(hit)).ravel().tolist()
        for hit in (first_hit(scene, x, 0.5) for x in (0.25, 0.75))
    ]
    np.testing.assert_allclose(colors, [[0.18, 0.18, 0.18], [0.8, 0, 0]])


def test_more_triangles_than_memory_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(meshes, "MOST_TRIANGLES", 30_000)
    with pytest.raises(PureLightError, match=r"/S/P/Ball.*30,000 triangles"):
        load_usd(stage(tmp_path, SCATTER.format(more="")))


# Subdivision surfaces

CUBE = """
def Mesh "Cube"
{{
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1,
                               2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    point3f[] points = [(-1, -1, -1), (-1, -1, 1), (-1, 1, -1), (-1, 1, 1),
                        (1, -1, -1), (1, -1, 1), (1, 1, -1), (1, 1, 1)]
    {more}
}}
"""


def extent(tmp_path: Path, more: str) -> float:
    """Radius of the cube along its diagonal."""
    scene = loaded(tmp_path, CUBE.format(more=more)).scene
    origin, direction = mi.Point3f(3, 3.002, 3.004), mi.Vector3f(*[-(3**-0.5)] * 3)
    hit = scene.ray_intersect(mi.Ray3f(origin, direction))
    inward = 1 if "leftHanded" in more else -1
    assert inward * float(dr.dot(hit.sh_frame.n, direction)[0]) > 0.5
    assert inward * float(dr.dot(hit.n, direction)[0]) > 0.5
    return float(dr.norm(mi.Vector3f(hit.p))[0])


def test_meshes_are_subdivided_unless_they_say_otherwise(tmp_path: Path) -> None:
    assert extent(tmp_path, "") == pytest.approx(0.5 * 3**0.5, rel=1e-3)
    assert extent(tmp_path, 'uniform token orientation = "leftHanded"') < 0.9
    creases = "int[] creaseIndices = [1, 5, 7, 3, 1]\n int[] creaseLengths = [5]\n"
    creases += "float[] creaseSharpnesses = [10]"
    assert 0.95 < extent(tmp_path, creases) < 1.6
    corner = "int[] cornerIndices = [7]\n float[] cornerSharpnesses = [10]"
    hit = loaded(tmp_path, CUBE.format(more=corner)).scene.bbox()
    np.testing.assert_allclose(np.array(hit.max), 1, atol=1e-6)


def test_holes_and_bare_boundaries_are_not_shown(tmp_path: Path) -> None:
    bottomless = 'int[] holeIndices = [4]\n uniform token subdivisionScheme = "{}"'
    for scheme in ("none", "catmullClark", "bilinear"):
        scene = loaded(tmp_path, CUBE.format(more=bottomless.format(scheme))).scene
        below = mi.Ray3f(mi.Point3f(0.1, 0.2, -5), mi.Vector3f(0, 0, 1))
        assert float(scene.ray_intersect(below).p.z[0]) > 0  # The inside of the upper face.
    quad = CUBE[: CUBE.index("int[]")] + CUBE[CUBE.index("point3f") :]
    face = "int[] faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 3, 2]\n"
    bare = face + 'uniform token interpolateBoundary = "none"'
    shown = [len(loaded(tmp_path, quad.format(more=m)).scene.shapes()) for m in (face, bare)]
    assert shown == [1, 0]


def test_creases_that_do_not_fit_are_named(tmp_path: Path) -> None:
    crease = "int[] creaseIndices = {}\n int[] creaseLengths = [2]\n"
    crease += "float[] creaseSharpnesses = [1]"
    corner = "int[] cornerIndices = [7, 6]\n float[] cornerSharpnesses = [1]"
    for wrong in (crease.format([1, 99]), crease.format([1, 5, 7]), corner):
        (note,) = loaded(tmp_path, CUBE.format(more=wrong)).notes
        assert "do not fit the mesh" in note


def test_parts_of_a_subdivided_mesh_keep_their_materials(tmp_path: Path) -> None:
    parts = 'uniform token subsetFamily:materialBind:familyType = "nonOverlapping"\n'
    parts += """
    def GeomSubset "Top" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [5]
        rel material:binding = </Red>
    }
"""
    red = """
def Material "Red"
{
    token outputs:surface.connect = </Red/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }
}
"""
    scene = loaded(tmp_path, CUBE.format(more=parts), red).scene
    hit = first_hit(scene, 0.5, 0.5)
    np.testing.assert_allclose(
        np.array(hit.bsdf().eval_diffuse_reflectance(hit)).ravel(), [1, 0, 0]
    )
    assert len(scene.shapes()) == 2


# Textures

MIRRORED = "[(1, 0), (0, 0), (0, 1), (1, 1)]"
READ = "float2 inputs:st.connect = </M/{}.outputs:result>"


def colors(folder: Path, reader: str, name: str = "st") -> np.ndarray:
    """What is seen above on the left, above on the right, and below on the left."""
    picture = np.zeros((2, 2, 3), np.float32)
    picture[0, 0], picture[0, 1], picture[1, 0] = np.eye(3)
    write_exr(folder / "map.exr", picture)
    inputs = "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>"
    prim = textured(inputs, RAW + reader, name=name)
    scene = loaded(folder, prim).scene
    hits = (first_hit(scene, x, y) for x, y in ((0.25, 0.25), (0.75, 0.25), (0.25, 0.75)))
    return np.array([np.array(h.bsdf().eval_diffuse_reflectance(h)).ravel() for h in hits])


def test_pictures_stand_upright(tmp_path: Path) -> None:
    np.testing.assert_allclose(colors(tmp_path, ""), np.eye(3), atol=1e-3)


def test_coordinates_are_those_that_the_material_names(tmp_path: Path) -> None:
    read = colors(tmp_path, READ.format("Where"), "picture")
    np.testing.assert_allclose(read, np.eye(3), atol=1e-3)


def test_textures_are_moved_as_they_say(tmp_path: Path) -> None:
    moved = colors(tmp_path, READ.format("Moved"), "picture")
    np.testing.assert_allclose(moved[:2], np.eye(3)[[1, 0]], atol=1e-3)


def tilted(folder: Path, uv: str, lean: np.ndarray, decoding: str) -> np.ndarray:
    """Where a floor with an even normal map sends most light that comes from above: x and y."""
    coded = np.broadcast_to(np.float32(0.5 + 0.5 * lean), (4, 4, 3))
    write_exr(folder / "map.exr", coded)
    inputs = "normal3f inputs:normal.connect = </M/T.outputs:rgb>"
    scene = loaded(folder, textured(inputs, RAW + decoding, uv=uv)).scene
    hit = first_hit(scene, 0.55, 0.45)
    x, y = (mi.Float(v.ravel()) for v in np.meshgrid(*[np.linspace(-0.95, 0.95, 41)] * 2))
    z = dr.safe_sqrt(1 - dr.square(x) - dr.square(y))
    wide = dr.gather(mi.SurfaceInteraction3f, hit, dr.zeros(mi.UInt32, dr.width(x)))
    out = wide.to_local(mi.Vector3f(x, y, z))
    value = hit.bsdf().eval(mi.BSDFContext(), wide, out, z > 0.2)
    best = int(np.argmax(np.array(value[0])))
    return np.array([x[best], y[best]])


DECODING = "float4 inputs:scale = (2, 2, 2, 1)\n float4 inputs:bias = (-1, -1, -1, 0)"


@pytest.mark.parametrize("uv", [UPRIGHT, MIRRORED])
@pytest.mark.parametrize("decoding", [DECODING, ""])
def test_normal_maps_lean_the_surface(uv: str, decoding: str, tmp_path: Path) -> None:
    """Red leans to where the picture's right is, green to where it is up."""
    sign = 1 if uv == UPRIGHT else -1
    for lean, towards in (([0.5, 0, 0.87], [0.87 * sign, 0]), ([0, 0.5, 0.87], [0, 0.87])):
        brightest = tilted(tmp_path, uv, np.array(lean), decoding)
        np.testing.assert_allclose(brightest, towards, atol=0.1)


# Lights

SHAPED = """float inputs:radius = 0.01
    float inputs:intensity = 10000
    {more}"""


def small_light(more: str, place: str, kind: str = "SphereLight") -> str:
    light = LIGHT.format(kind=kind, values=SHAPED.format(more=more), place=place)
    return light.replace('"Light"', '"Light" ( prepend apiSchemas = ["ShapingAPI"] )')


def at_origin(folder: Path, light: str) -> np.ndarray:
    """Irradiance of a floor at the origin by the one light."""
    scene = loaded(folder, light).scene
    (emitter,) = scene.emitters()
    here = dr.zeros(mi.Interaction3f, 4096)
    u = mi.Point2f(*np.random.default_rng(0).random((2, 4096)).astype(np.float32))
    sample, light_of = emitter.sample_direction(here, u)
    return np.array(light_of * sample.d.z).mean(1)


def test_a_room_that_goes_leaves_no_light_behind(tmp_path: Path) -> None:
    """Mitsuba asks every light of a process for its shape, and fails at one whose shape is gone."""
    from purelight_mitsuba.usd_scene.shaped_area import ShapedArea

    def lights() -> int:
        return sum(isinstance(o, ShapedArea) for o in gc.get_objects())

    gc.collect()
    gc.disable()
    try:
        before, cone = lights(), "float inputs:shaping:cone:angle = 40"
        found = loaded(tmp_path, small_light(cone, "(0, 0, 2, 1)"))
        assert lights() == before + 1
        del found
        assert lights() == before
    finally:
        gc.enable()


def shaped(folder: Path, more: str, place: str = "(0, 0, 2, 1)") -> np.ndarray:
    """Irradiance of the floor below a small sphere light, or beside it."""
    return at_origin(folder, small_light(more, place))


ASIDE = "(2, 0, 2, 1)"  # 45 degrees off the axis.


def test_a_cone_ends_where_it_says(tmp_path: Path) -> None:
    below, beside = shaped(tmp_path, ""), shaped(tmp_path, "", ASIDE)
    cone = "float inputs:shaping:cone:angle = {}\n float inputs:shaping:cone:softness = {}"
    np.testing.assert_allclose(shaped(tmp_path, cone.format(40, 0)), below, rtol=1e-3)
    assert shaped(tmp_path, cone.format(40, 0), ASIDE).max() == 0
    np.testing.assert_allclose(shaped(tmp_path, cone.format(50, 0), ASIDE), beside, rtol=1e-3)
    soft = shaped(tmp_path, cone.format(50, 0.5), ASIDE)
    step = 1 - (t := (45 - 25) / 25) ** 2 * (3 - 2 * t)
    np.testing.assert_allclose(soft, step * beside, rtol=0.02)


def test_focus_takes_what_is_off_the_axis(tmp_path: Path) -> None:
    focus = "float inputs:shaping:focus = 6\n color3f inputs:shaping:focusTint = (0, 0.5, 1)"
    found = shaped(tmp_path, focus, ASIDE) / shaped(tmp_path, "", ASIDE)
    left = 0.5**3
    np.testing.assert_allclose(found, [left, 0.5 + 0.5 * left, 1], rtol=0.02)
    np.testing.assert_allclose(shaped(tmp_path, focus), shaped(tmp_path, ""), rtol=0.01)


def profile(folder: Path, vertical: list[int], candela: list[float], multiplier: float = 1) -> None:
    text = f"IESNA:LM-63-2002\nTILT=NONE\n1 100 {multiplier} {len(vertical)} 1 1 2 0 0 0\n1 1 10\n"
    rows = (vertical, [0], candela)
    (folder / "p.ies").write_text(text + "\n".join(" ".join(map(str, row)) for row in rows) + "\n")


IES = "asset inputs:shaping:ies:file = @./p.ies@\n bool inputs:shaping:ies:normalize = {}"


def test_a_profile_is_a_factor_by_direction(tmp_path: Path) -> None:
    profile(tmp_path, [0, 45, 90, 180], [3.0, 2.0, 1.0, 0.0], multiplier=2)
    below, beside = shaped(tmp_path, ""), shaped(tmp_path, "", ASIDE)
    np.testing.assert_allclose(shaped(tmp_path, IES.format(0)), 6 * below, rtol=0.01)
    np.testing.assert_allclose(shaped(tmp_path, IES.format(0), ASIDE), 4 * beside, rtol=0.01)
    wider = IES.format(0) + "\n float inputs:shaping:ies:angleScale = 0.5"
    np.testing.assert_allclose(shaped(tmp_path, wider, ASIDE), 2 * beside, rtol=0.01)


@pytest.mark.parametrize(("vertical", "factor"), [([0, 90, 180], 1.0), ([0, 45, 90], 1.0)])
def test_a_normalised_profile_keeps_the_mean(
    vertical: list[int], factor: float, tmp_path: Path
) -> None:
    """That of all directions, or of those below where it knows no others."""
    profile(tmp_path, vertical, [700.0] * 3)
    expected = factor * shaped(tmp_path, "")
    np.testing.assert_allclose(shaped(tmp_path, IES.format(1)), expected, rtol=0.02)


def test_profiles_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    for text in (None, "nonsense", "TILT=NONE\n1 1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n0 0\n"):
        if text is not None:
            (tmp_path / "p.ies").write_text(text)
        (note,) = loaded(tmp_path, small_light(IES.format(0), "(0, 0, 2, 1)")).notes
        assert "profile" in note
        assert "ignored" in note


def test_shaping_without_its_schema_is_not_shaping(tmp_path: Path) -> None:
    light = small_light("float inputs:shaping:cone:angle = 10", ASIDE)
    plain = light.replace(' ( prepend apiSchemas = ["ShapingAPI"] )', "")
    assert at_origin(tmp_path, light).max() == 0
    np.testing.assert_allclose(at_origin(tmp_path, plain), shaped(tmp_path, "", ASIDE), rtol=1e-3)


def test_a_turned_light_turns_its_cone(tmp_path: Path) -> None:
    light = small_light("float inputs:shaping:cone:angle = 30", ASIDE)
    upright = "(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)"
    turned = "(1, 0, -1, 0), (0, 1.41421356, 0, 0), (1, 0, 1, 0)"
    assert at_origin(tmp_path, light).max() == 0
    aimed = at_origin(tmp_path, light.replace(upright, turned).replace("0.01", "0.0070711"))
    np.testing.assert_allclose(aimed, shaped(tmp_path, "", ASIDE), rtol=0.01)


def test_warm_light_is_warm(tmp_path: Path) -> None:
    warm = "bool inputs:enableColorTemperature = 1\n float inputs:colorTemperature = {}"
    found = shaped(tmp_path, warm.format(2700))
    assert found[0] > 1.5 * found[1] > 3 * found[2]
    even = shaped(tmp_path, "")
    np.testing.assert_allclose(found @ [0.2126, 0.7152, 0.0722], even[0], rtol=0.01)


def test_shaped_lights_are_sampled_as_they_are_seen(tmp_path: Path) -> None:
    """Paths that run into a shaped light agree with those that aim at it."""
    values = "float inputs:radius = 0.6\n float inputs:shaping:focus = 4"
    values += "\n float inputs:shaping:cone:angle = 50\n float inputs:shaping:cone:softness = 1"
    light = LIGHT.format(kind="DiskLight", values=values, place="(0.3, 0, 1, 1)")
    light = light.replace('"Light"', '"Light" ( prepend apiSchemas = ["ShapingAPI"] )')
    scene = loaded(tmp_path, FLOOR.replace("0.01", "3"), light).scene
    view = mi.ScalarTransform4f().look_at([0, 0, 0.9], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
    eye = mi.load_dict({"type": "perspective", "to_world": view, "fov": 60, "near_clip": 0.01,
                        "film": film})  # fmt: skip
    means = []
    for aim, run in ((1, 0), (0, 1)):
        direct = mi.load_dict({"type": "direct", "emitter_samples": aim, "bsdf_samples": run})
        means.append(np.array(mi.render(scene, sensor=eye, integrator=direct, spp=1 << 16)).mean())
    assert means[0] > 0.01
    np.testing.assert_allclose(means[0], means[1], rtol=0.04)  # Four deviations.
