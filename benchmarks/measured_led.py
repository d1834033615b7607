"""A measured LED under a lens: trained and exported, beside a trace of the same rays by hand.

python -m benchmarks.measured_led led.tm25ray [--preset draft] [--output out/bench/measured_led]

The LED, a ray file of a few millimetres around z = 0 that shines up, stands under a plano-convex
lens of acrylic. The reference knows neither Mitsuba nor meshes: it takes each ray of the file
through a plane and a sphere by Snell and Fresnel. Compared are all the light, its cone of half the
power, intensities by zones, and a wall 1 m above: of our tracer, and of rays drawn from the
exported bundle.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks.ray_files import Table, difference
from purelight_examples.luminaires.parts import revolve
from purelight_examples.luminaires.solids import joined
from purelight_export.rays import bundle_rays, traced_rays
from purelight_format import atomic, command
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.files import read_ray_file
from purelight_format.ray_file.rays import Rays
from purelight_mitsuba import platform
from purelight_onnx.luminaire import Luminaire

IOR = 1.49
RADIUS, CENTRE, PLANE = 15e-3, -5e-3, 1e-3  # Metres: of the sphere, its height, the flat side's.
BOUNCES = 32
DRAWN = 1 << 20  # Rays of the tracer and of the bundle; the file's are each traced `COPIES` times.
COPIES = 10
ZONES, AROUND = 18, 8  # Of 5 degrees from the axis, and around it.
WALL, CELLS = 1.0, 8  # Metres: its height and its width; cells of an edge.


# The reference: a plane and a sphere


def through_lens(rays: Rays, rng: np.random.Generator) -> Rays:
    """Rays that leave the lens for good; each surface reflects or refracts by chance.

    Arguments:
        rays: outside the lens.
    """
    place, toward = (a.astype(np.float64) for a in (rays.position, rays.direction))
    inside = np.zeros(len(place), bool)
    alive = np.arange(len(place))
    for _ in range(BOUNCES):
        t, normal = crossing(place[alive], toward[alive], inside[alive])
        hit = np.isfinite(t)
        alive, t, normal = alive[hit], t[hit], normal[hit]
        if not len(alive):
            break
        place[alive] += t[:, None] * toward[alive]
        ratio = np.where(inside[alive], IOR, 1 / IOR)
        toward[alive], passed = scattered(toward[alive], normal, ratio, rng.random(len(alive)))
        inside[alive] ^= passed
    gone = ~inside
    return Rays(
        place[gone].astype(np.float32), toward[gone].astype(np.float32), rays.power[gone]
    )  # fmt: skip


def crossing(place: Table, toward: Table, inside: NDArray[np.bool_]) -> tuple[Table, Table]:
    """Where rays meet the lens next, and its normal there, outward: [N] (inf if nowhere), [N, 3].

    The lens is convex, the part of a ball above a plane: a ray is in it between two distances.
    """
    offset = place - np.array([0, 0, CENTRE])
    b, c = (offset * toward).sum(1), (offset**2).sum(1) - RADIUS**2
    root = np.sqrt(np.maximum(b * b - c, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = (PLANE - place[:, 2]) / toward[:, 2]
    up = toward[:, 2] > 0
    low, high = np.where(up, flat, -np.inf), np.where(up, np.inf, flat)
    first, last = np.maximum(-b - root, low), np.minimum(-b + root, high)
    met = (b * b > c) & (first < last)
    t = np.where(inside, last, first)
    by_plane = np.where(inside, high < -b + root, low > -b - root)
    met &= t > np.where(inside, -1e-9, 1e-9)
    normal = (offset + np.where(met, t, 0)[:, None] * toward) / RADIUS
    normal[by_plane] = (0, 0, -1)
    return np.where(met, np.maximum(t, 0), np.inf), normal


def scattered(
    toward: Table, normal: Table, ratio: Table, chance: Table
) -> tuple[Table, NDArray[np.bool_]]:
    """Snell and Fresnel, by chance one of the two: directions [N, 3], whether refracted [N].

    Arguments:
        ratio: index on the ray's side over the index beyond.
    """
    cosine = -(toward * normal).sum(1)
    normal, cosine = normal * np.sign(cosine)[:, None], np.abs(cosine)
    sine2 = ratio**2 * (1 - cosine**2)
    beyond = np.sqrt(np.maximum(1 - sine2, 0))
    s = (ratio * cosine - beyond) / (ratio * cosine + beyond)
    p = (cosine - ratio * beyond) / (cosine + ratio * beyond)
    reflected = np.where(sine2 >= 1, 1.0, (s**2 + p**2) / 2)
    passed = chance >= reflected
    mirrored = toward + 2 * cosine[:, None] * normal
    bent = ratio[:, None] * toward + (ratio * cosine - beyond)[:, None] * normal
    result = np.where(passed[:, None], bent, mirrored)
    return result / np.linalg.norm(result, axis=1, keepdims=True), passed


# The same as a scene


def write_scene(folder: Path, led: Path) -> Path:
    """The LED and the lens as a mesh with normals, which people have from CAD: `lamp.xml`."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(led, folder / "led.tm25ray")
    lens().export(folder / "lens.ply", vertex_normal=True)
    scene = folder / "lamp.xml"
    scene.write_text(f"""<scene version="3.0.0">
  <emitter type="ray_file"><string name="filename" value="led.tm25ray"/></emitter>
  <shape type="ply" id="lens"><string name="filename" value="lens.ply"/>
    <bsdf type="dielectric"><float name="int_ior" value="{IOR}"/></bsdf></shape>
</scene>
""")
    return scene


def lens(rings: int = 64, around: int = 192) -> trimesh.Trimesh:
    """The closed lens. Its rim is sharp: each point there is a vertex of either side."""
    edge = np.arccos((PLANE - CENTRE) / RADIUS)
    angle = np.linspace(edge, 0, rings + 1)
    arc = np.column_stack([RADIUS * np.sin(angle), CENTRE + RADIUS * np.cos(angle)])
    whole = revolve(np.concatenate(([[0, PLANE]], arc)), around)
    flat = whole.face_normals[:, 2] < -0.999
    base, cap = (whole.submesh([part], append=True) for part in (flat, ~flat))
    base.vertex_normals = np.tile((0.0, 0, -1), (len(base.vertices), 1))
    cap.vertex_normals = (cap.vertices - (0, 0, CENTRE)) / RADIUS
    return joined([cap, base])


# What is compared


def figures(rays: Rays, lumens: float) -> dict[str, Any]:
    """Of rays that leave: light over the LED's, the cone of half of it, zones, cells of the wall.

    Returns:
        `light`, `half` in degrees from the axis, `zones` [ZONES * AROUND], `wall` [CELLS²].
    """
    light = rays.power @ LUMINANCE * LUMENS_PER_WATT
    toward, place = rays.direction.astype(np.float64), rays.position.astype(np.float64)
    polar = np.degrees(np.arccos(np.clip(toward[:, 2], -1, 1)))
    around = np.degrees(np.arctan2(toward[:, 1], toward[:, 0]))
    order = np.argsort(polar)
    half = np.searchsorted(np.cumsum(light[order]), light.sum() / 2)
    up = toward[:, 2] > 0
    at = place[up] + ((WALL - place[up, 2]) / toward[up, 2])[:, None] * toward[up]
    edge = np.linspace(-WALL / 2, WALL / 2, CELLS + 1)
    return {
        "light": float(light.sum() / lumens),
        "half": float(polar[order][half]),
        "zones": _sums(
            polar, around, np.linspace(0, 90, ZONES + 1), np.linspace(-180, 180, AROUND + 1), light
        ),
        "wall": _sums(at[:, 0], at[:, 1], edge, edge, light[up]),
    }  # fmt: skip


def _sums(x: Table, y: Table, x_edges: Table, y_edges: Table, light: Table) -> Table:
    return np.histogram2d(x, y, [x_edges, y_edges], weights=light)[0].ravel()


def main() -> int:
    """Run the benchmark; prints the figures and writes them."""
    parser = command.Parser(
        prog="python -m benchmarks.measured_led", description=__doc__.split("\n")[0]
    )
    add = parser.add_argument
    add("led", type=Path)
    add("--preset", default="draft")
    add("--threads", type=command.whole(1), default=1)
    add("--output", type=Path, default=Path("out/bench/measured_led"))
    options = parser.parse_args()
    platform.prepare()
    platform.use()
    import purelight_export.cli
    import purelight_train.cli
    from purelight_train.light.luminaire import load_luminaire

    led, out = rays_of(read_ray_file(options.led)), options.output
    scene, run, bundle = write_scene(out / "lamp", options.led), out / "run", out / "lamp.plux"
    words = ["--preset", options.preset, "--threads", str(options.threads), "--resume"]
    if not bundle.is_file():
        if purelight_train.cli.main([str(scene), "--output", str(run), *words]):
            return 2
        if purelight_export.cli.main([str(run), "--output", str(bundle)]):
            return 2
    by_hand = through_lens(repeated(led, COPIES), np.random.default_rng(1))
    traced = traced_rays(load_luminaire(scene), DRAWN, 2)
    ours = bundle_rays(Luminaire.open(bundle, threads=options.threads), DRAWN, 3)
    every = {"bare": led, "by hand": by_hand, "traced": traced, "bundle": ours}
    found = {name: figures(rays, led.lumens) for name, rays in every.items()}
    true = found["by hand"]
    table = {
        name: {"light": round(one["light"], 4), "half of it within": round(one["half"], 2)}
        | {what: difference(one[what], true[what]) for what in ("zones", "wall")}
        for name, one in found.items()
    }
    print(json.dumps(table, indent=1))
    atomic.write_bytes(out / "measured_led.json", json.dumps(table, indent=1).encode())
    return 0


def repeated(rays: Rays, copies: int) -> Rays:
    """Each ray several times, for each of its chances."""
    many = [np.repeat(a, copies, 0) for a in (rays.position, rays.direction, rays.power)]
    return Rays(many[0], many[1], many[2] / np.float32(copies))


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.measured_led", main))
