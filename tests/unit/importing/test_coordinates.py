"""Where pictures lie on the shapes of Mitsuba's scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.formats import read
from purelight_import.importing import import_lamp, read_lamp
from purelight_import.model.mesh import Mesh
from purelight_import.parts.hull import hull
from purelight_import.read.solids import SECTIONS, SOLIDS
from purelight_import.write.scene import write_ply

pytestmark = pytest.mark.usefixtures("at_once")
RAYS = 20_000
TURNED = (
    '<scale value="2"/><rotate x="0.6" z="0.8" angle="77"/><translate x="1" y="2" z="3"/>'
)  # fmt: skip
MOVES = {"plain": "", "turned": TURNED, "mirrored": f'<scale y="-1"/>{TURNED}'}
GLOW = '<emitter type="area"><rgb name="radiance" value="100"/></emitter>'
BITMAP = (
    '<texture type="bitmap" name="{name}"><string name="filename" value="rows.png"/>'
    '<boolean name="raw" value="true"/></texture>'
)
PAINT = (
    '<texture type="mesh_attribute" name="reflectance"><string name="name" value="vertex_color"/>'
    "</texture>"
)
BULB = f'<shape type="sphere" id="bulb"><float name="radius" value="0.02"/>{GLOW}</shape>'


def scene(folder: Path, body: str) -> Path:
    path = folder / "shelf.xml"
    path.write_text(f'<scene version="3.0.0">{body}</scene>')
    return path


def rows(folder: Path) -> None:
    """A picture that is white in its upper quarter and at the right of the rest."""
    pixels = np.zeros((64, 64), np.uint8)
    pixels[:16], pixels[16:, 40:] = 255, 255
    Image.fromarray(pixels).save(folder / "rows.png")


def met(mi: Any, scene: Any, box: Any) -> Any:
    """What rays from all around a box through it meet first."""
    rng = np.random.default_rng(0)
    middle, size = np.array(box.center()).ravel(), np.linalg.norm(np.array(box.extents()))
    around = rng.normal(size=(3, RAYS))
    origin = middle[:, None] + 2 * size * around / np.linalg.norm(around, axis=0)
    target = middle[:, None] + 0.3 * size * rng.uniform(-1, 1, (3, RAYS))
    direction = target - origin
    direction /= np.linalg.norm(direction, axis=0)
    return scene.ray_intersect(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction)))


def both_met(mi: Any, path: Path, mesh: Mesh) -> tuple[dict[str, np.ndarray], ...]:
    """What the same rays meet of a scene and of a mesh, where both are met at one place."""
    write_ply(path.parent / "made.ply", mesh, flat=mesh.normals is None)
    made = {"type": "ply", "filename": str(path.parent / "made.ply"), "face_normals": False}
    whole = mi.load_file(str(path))
    scenes = (whole, mi.load_dict({"type": "scene", "made": made}))
    hits = [met(mi, each, whole.bbox()) for each in scenes]
    fields = [
        {"p": np.array(hit.p), "uv": np.array(hit.uv), "n": np.array(hit.sh_frame.n),
         "dp_du": np.array(hit.dp_du)}
        for hit in hits
    ]  # fmt: skip
    valid = np.logical_and(*(np.array(hit.is_valid()) for hit in hits))
    near = np.linalg.norm(fields[0]["p"] - fields[1]["p"], axis=0) < 0.05
    return tuple({k: v[:, valid & near] for k, v in each.items()} for each in fields)


@pytest.mark.parametrize("kind", [*SOLIDS, "cube"])
@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("flip", ["true", "false"])
def test_coordinates_are_those_of_mitsuba(
    kind: str, move: str, flip: str, mitsuba: Any, tmp_path: Path
) -> None:
    turn = f'<transform name="to_world">{MOVES[move]}</transform>'
    flag = f'<boolean name="flip_normals" value="{flip}"/>'
    path = scene(tmp_path, f'<shape type="{kind}">{flag}{turn}</shape>')
    wanted, found = both_met(mitsuba, path, read(path).parts[0].mesh)
    apart = np.abs(wanted["uv"] - found["uv"])
    assert apart.shape[1] > RAYS / 4
    apart = np.minimum(apart, 1 - apart)  # On a seam both ends are right.
    assert np.percentile(apart, 99, axis=1).max() < 1 / SECTIONS
    assert ((wanted["dp_du"] * found["dp_du"]).sum(0) > 0).mean() > 0.999
    if (kind, move) != ("sphere", "mirrored"):  # Mitsuba turns it inside out where it is met alone.
        assert ((wanted["n"] * found["n"]).sum(0) > 0.9).mean() > 0.999


@pytest.mark.parametrize("kind", SOLIDS)
def test_no_triangle_wraps_around_the_picture(kind: str) -> None:
    mesh = SOLIDS[kind]()
    assert mesh.uv is not None
    uv = mesh.uv[mesh.triangles]
    assert uv.min() >= 0
    assert uv.max() <= 1
    if kind != "rectangle":
        around = 1 if kind == "disk" else 0
        assert np.ptp(uv, axis=1)[:, around].max() < 1.01 / SECTIONS


def test_a_sphere_is_closed_and_round() -> None:
    mesh = SOLIDS["sphere"]()
    about = hull(mesh)
    assert about.all_closed
    assert len(about.volume) == 1
    assert about.volume[0] == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    assert mesh.areas.min() > 0


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "disk"])
def test_a_globe_with_holes_lets_as_much_light_through(
    kind: str, mitsuba: Any, tmp_path: Path
) -> None:
    """Holes in a quarter and in columns: the flux, and what of it goes up, are the original's."""
    from purelight_train.light.light_tracing import trace_records

    rows(tmp_path)
    black = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
    mask = f'<bsdf type="mask">{BITMAP.format(name="opacity")}<bsdf type="twosided">{black}</bsdf>'
    place = '<scale value="0.1"/><translate z="-0.05"/>'
    body = (
        f'<shape type="{kind}"><transform name="to_world">{place}</transform>{mask}</bsdf></shape>'
    )
    path = scene(tmp_path, f"{body}{BULB}")
    made = import_lamp(path, tmp_path / "out", picture=False).scene
    files = [mitsuba.load_file(str(file), optimize=False) for file in (path, made)]
    before, after = (trace_records(each, 1, 1) for each in files)
    assert after.flux[0] == pytest.approx(before.flux[0], rel=0.01)
    up = [each.weight[each.direction[:, 2] > 0].sum() / each.paths for each in (before, after)]
    assert up[1] == pytest.approx(up[0], rel=0.02)


def test_a_picture_on_a_mesh_without_coordinates_is_noted(mitsuba: Any, tmp_path: Path) -> None:
    rows(tmp_path)
    cube = mitsuba.load_dict({"type": "cube"})
    parameters = mitsuba.traverse(cube)
    positions = np.array(parameters["vertex_positions"], np.float64).reshape(-1, 3)
    bare = Mesh(positions, np.array(parameters["faces"], np.uint32).reshape(-1, 3))
    write_ply(tmp_path / "bare.ply", bare, flat=True)
    written = '<string name="filename" value="bare.ply"/>'
    bsdf = f'<bsdf type="diffuse">{BITMAP.format(name="reflectance")}</bsdf>'
    paint = f'<bsdf type="twosided"><bsdf type="diffuse">{PAINT}</bsdf></bsdf>'
    path = scene(
        tmp_path,
        f'<shape type="ply" id="bare">{written}{bsdf}</shape><shape type="ply" id="painted">'
        f'{written}{paint}</shape><shape type="cube" id="box">{bsdf}</shape>'
        f'<shape type="sphere" id="globe">{bsdf}</shape>{BULB}',
    )
    lines = read_lamp(path)[0].notes.lines()
    (repeated,) = [line for line in lines if "on every triangle" in line]
    assert repeated.endswith("(bare)")
    (black,) = [line for line in lines if "finds black" in line]
    assert black.endswith("(painted)")
