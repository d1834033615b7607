"""Lamps of a kind share one body, and are met and seen as if each had one of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.members.finishes import Finish
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.exits import ExitSurfaces, Hit
from purelight_mitsuba.lamps.instances import CORNERS, FACES, REACH
from tests.support import analytic_lamps as lamps
from tests.support.agreement import passes
from tests.support.analytic_lamps import CENTRE, RADIUS, Lamp
from tests.support.finished_lamps import MATT, MIRROR, finished

T = mi.ScalarTransform4f
MILK = Finish("milk", (0.3, 0.3, 0.3), opacity=0.0, scattered_ahead=(0.3, 0.3, 0.3),
              scattered_back=(0.3, 0.2, 0.1))  # fmt: skip
RAYS = 20_000

Placed = tuple[str, Any]  # The kind of a lamp, and where it hangs.


def kinds(tilt: float) -> dict[str, Lamp]:
    """Lamps of unlike shapes, whose bundles differ if their tilts do."""
    return {
        "ball": lamps.ball(tilt),
        "panes": lamps.two_panes(0.5 + tilt),
        "sheet": lamps.glass_sheet([0.5 + tilt] * 3),
        "matt": finished(lamps.ball(tilt), replace(MATT, smooth=True)),
    }


def hung(folder: Path, placed: Sequence[Placed], *, apart: bool) -> mi.Scene:
    """A room with lamps, each of a bundle of its own if they are to share nothing."""
    content = lamps.room()
    for number, (kind, to_world) in enumerate(placed):
        path = folder / f"{kind}{number if apart else ''}.plux"
        if not path.exists():
            kinds(1e-6 * (number + 1) * apart)[kind].write(path)
        content[f"lamp{number:03}"] = {
            "type": "purelight", "filename": str(path), "to_world": to_world,
        }  # fmt: skip
    return mi.load_dict(content)


def exits(scene: mi.Scene) -> ExitSurfaces:
    own = [e for e in scene.emitters() if isinstance(e, PureLightEmitter)]
    return ExitSurfaces(own, scene)


def bodies(scene: mi.Scene) -> tuple[int, int]:
    """How many hang in the world, and how many are shared."""
    own = exits(scene)
    shared = [] if own.instances is None else own.instances.bodies.counts
    return len(own.hanging.counts), len(shared)


def around(x: float, y: float, z: float, scale: float = 1.0, turn: float = 0.0) -> Any:
    """A placement by the centre of the bounding sphere."""
    move = T().translate([x, y, z]).rotate([0.6, 0, 0.8], turn).scale(scale)
    return move.translate([-c for c in CENTRE])


def grid(spacing: float, names: Sequence[str], count: int = 4) -> list[Placed]:
    cells = np.stack(np.meshgrid(*[np.arange(count)] * 2), -1).reshape(-1, 2) * spacing
    return [
        (names[k % len(names)], around(*cell, 0.3 * (k % 3), 0.7 + 0.1 * (k % 4), 37.0 * k))
        for k, cell in enumerate(cells)
    ]


SCENES: dict[str, tuple[list[Placed], tuple[int, int]]] = {
    "apart": (grid(0.9, ["ball", "panes", "sheet", "matt"]), (0, 4)),
    "some that overlap": (
        [*grid(0.9, ["ball", "panes"]), ("ball", around(5, 0, 0)), ("ball", around(5.1, 0, 0))],
        (2, 2),
    ),
    "too close for hulls": ([("ball", around(2.2 * RADIUS * k, 0, 0)) for k in range(4)], (4, 0)),
    "one of a kind": ([("ball", around(0, 0, 0)), ("panes", around(2, 0, 0))], (2, 0)),
    "large and small": (
        [("panes", around(x, 0, 0, size, 300 * x))
         for x, size in ((-9, 10), (0, 1), (0.7, 0.1), (0.8, 0.01), (0.81, 0.001))], (0, 1)
    ),
    "far from the origin": (
        [("ball", around(500 + k, 300, 200, 0.5)) for k in range(3)], (0, 1)
    ),
}  # fmt: skip


def rays(placed: Sequence[Placed], seed: int) -> mi.Ray3f:
    """Toward lamps, half of them from within the sphere of one; some end on the way."""
    rng = np.random.default_rng(seed)
    matrices = np.array([np.array(to_world.matrix).reshape(4, 4) for _, to_world in placed])
    start, end = matrices[rng.integers(len(placed), size=(2, RAYS))]
    near = rng.normal(size=(RAYS, 3))
    near *= 0.95 * RADIUS * rng.random((RAYS, 1)) / np.linalg.norm(near, axis=1, keepdims=True)
    near[::2] *= 8
    goal = CENTRE + RADIUS * rng.uniform(-1.2, 1.2, (RAYS, 3)) / np.sqrt(3)
    origin, target = (
        np.einsum("nij,nj->ni", m[:, :3, :3], p) + m[:, :3, 3]
        for m, p in ((start, CENTRE + near), (end, goal))
    )
    length = np.linalg.norm(target - origin, axis=1)
    ray = mi.Ray3f(
        mi.Point3f(origin.T), mi.Vector3f(((target - origin) / length[:, None]).T)
    )  # fmt: skip
    ray.maxt = mi.Float(np.where(rng.random(RAYS) < 0.3, rng.random(RAYS) * length, np.inf))
    return ray


def columns(found: Hit, own: ExitSurfaces) -> dict[str, np.ndarray]:
    facet = found.facet - own.first_facet(found.lamp)
    return {
        "t": np.array(found.t), "lamp": np.array(found.lamp), "facet": np.array(facet),
        "normal": np.array(found.normal).T, "uv": np.array(found.uv).T,
    }  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_rays_meet_lamps_that_share_as_those_that_do_not(tmp_path: Path, name: str) -> None:
    placed, count = SCENES[name]
    shared, apart = (hung(tmp_path, placed, apart=each) for each in (False, True))
    assert bodies(shared) == count
    assert bodies(apart) == (len(placed), 0)
    ray = rays(placed, len(name))
    own = [exits(scene) for scene in (shared, apart)]
    found = [each.intersect(ray, mi.Bool(True)) for each in own]
    valid = [np.array(each.valid) for each in found]
    assert 0.2 < valid[1].mean() < 0.999
    both = valid[0] & valid[1]
    assert (valid[0] == valid[1]).mean() > 0.999  # An edge may be met or not
    ours, theirs = (columns(*pair) for pair in zip(found, own, strict=True))
    same = both & (ours["lamp"] == theirs["lamp"]) & (ours["facet"] == theirs["facet"])
    assert same.sum() > 0.995 * both.sum()
    furthest = np.abs(np.array(ray.o)).max() + theirs["t"][same].max()
    np.testing.assert_allclose(ours["t"][same], theirs["t"][same], atol=1e-6 * furthest)
    np.testing.assert_allclose(ours["normal"][same], theirs["normal"][same], atol=1e-6)


def test_of_many_lamps_only_kinds_have_bodies(tmp_path: Path) -> None:
    placed: list[Placed] = [("ball", around(k % 20, k // 20, 0, 0.3)) for k in range(400)]
    placed[7] = ("panes", placed[7][1])
    scene = hung(tmp_path, placed, apart=False)
    assert bodies(scene) == (1, 1)


def test_lamps_that_answer_light_and_those_that_do_not_are_two_kinds(tmp_path: Path) -> None:
    path = kinds(0.0)["matt"].write(tmp_path / "matt.plux")
    content = lamps.room() | {
        f"lamp{k}": {
            "type": "purelight", "filename": str(path), "to_world": around(k, 0, 0),
            "finishes": k % 2 == 0,
        } for k in range(6)
    }  # fmt: skip
    assert bodies(mi.load_dict(content)) == (0, 2)


ANSWERS = {
    "says nothing": lamps.ball,
    "matt": lambda tilt: finished(lamps.ball(tilt), MATT),
    "smooth": lambda tilt: finished(lamps.ball(tilt), replace(MATT, smooth=True)),
    "mirror": lambda tilt: finished(lamps.ball(tilt), MIRROR),
    "scattering": lambda tilt: finished(lamps.ball(tilt), MILK),
}
PLACES = (around(0.5, 0.2, 0, 1.1, 50), around(-0.6, 0.1, 0.3, 0.8, 200), around(0, -0.6, 0, 0.9))


@pytest.mark.parametrize("engine", ["fused", "queued"])
@pytest.mark.parametrize("name", ANSWERS)
def test_pictures_of_lamps_that_share_are_those_of_others(
    tmp_path: Path, name: str, engine: str
) -> None:
    """Also where one of three hangs alone, so that finishes are on both sorts of bodies."""
    paths = [ANSWERS[name](1e-6 * k).write(tmp_path / f"{k}.plux") for k in range(3)]
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.4]}}

    def rendered(order: Sequence[int], count: tuple[int, int]) -> np.ndarray:
        own = {
            f"lamp{k}": {"type": "purelight", "filename": str(paths[k_]), "to_world": place}
            for k, (k_, place) in enumerate(zip(order, PLACES, strict=True))
        }
        scene = mi.load_dict(lamps.room() | {"sky": sky} | own)
        assert bodies(scene) == count
        integrator = {"type": "purelight", "engine": engine, "max_depth": 6}
        return passes(scene, integrator, spp=8, count=1)

    apart = rendered((0, 1, 2), (3, 0))
    assert (apart > 0).any()
    for order, count in (((0, 0, 0), (0, 1)), ((0, 1, 0), (1, 1))):
        shared = rendered(order, count)
        near = np.abs(shared - apart) <= 1e-3 * (apart + apart.mean())
        assert near.mean() > 0.99


def test_hulls_hold_spheres() -> None:
    assert FACES.shape == (20, 3)
    assert CORNERS.shape == (12, 3)
    corners = CORNERS[FACES]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    distance = np.abs((normal * corners[:, 0]).sum(1)) / np.linalg.norm(normal, axis=1)
    np.testing.assert_allclose(distance, 1.0)
    assert 1.25 < np.linalg.norm(CORNERS, axis=1).max() < REACH
