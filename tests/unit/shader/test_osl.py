"""OSL in Cycles, where there is a Python with Blender: golden vectors, and a lamp that hangs askew.

`PURELIGHT_BPY_PYTHON` names such a Python, if it is not this one: `pip install bpy` makes one.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from purelight_format.bundle import Bundle
from purelight_format.measures import Placement
from purelight_onnx.luminaire import Luminaire
from purelight_shader import contents, write
from tests.support import osl_picture

ASKEW = np.array(
    [[0, -1.5, 0, 0.2], [1.5, 0, 0, -0.1], [0, 0, 1.5, 0.4], [0, 0, 0, 1]]
)  # fmt: skip


def require_blender() -> None:
    if osl_picture.python() is None:
        pytest.skip(f"no Python with bpy is known: name one in {osl_picture.VARIABLE}")


def shares(folder: Path, found: np.ndarray, first: int) -> dict[str, float]:
    """The largest error of each network in units of its tolerance."""
    about = json.loads((folder / "lamp.json").read_text())["selftest"]
    size = about["rows"], about["outputs"]
    expected, allowed = (
        np.fromfile(folder / f"selftest_{name}.bin", "<f4").reshape(size)[:, first : first + 3]
        for name in ("expected", "tolerances")
    )
    network = np.fromfile(folder / "selftest_inputs.bin", "<f4").reshape(about["rows"], -1)[:, 0]
    off = np.abs(found[:, : expected.shape[1]] - expected)
    with np.errstate(all="ignore"):
        share = np.where(off == 0, 0, off / allowed)
    return {name: float(share[network == k].max()) for k, name in enumerate(about["networks"])}


@pytest.mark.parametrize("first", [0, 1, 400])
def test_golden_vectors_are_met(first: int, octahedron: Bundle, tmp_path: Path) -> None:
    """Three numbers of every answer, and so all of every network but the map."""
    require_blender()
    write(octahedron, "osl", tmp_path)
    rows = json.loads((tmp_path / "lamp.json").read_text())["selftest"]["rows"]
    found = shares(tmp_path, osl_picture.answers(tmp_path, first, rows), first)
    assert set(found) == set(octahedron.manifest.networks)
    assert max(found.values()) <= 1, found


def test_a_lamp_that_hangs_askew_looks_as_it_should(octahedron: Bundle, tmp_path: Path) -> None:
    """Its radiance along a camera's rays: turned, scaled, dimmed, on triangles of either side."""
    require_blender()
    write(octahedron, "osl", tmp_path)
    surface, size, span = octahedron.surface(), 24, 0.35
    place, lamp = Placement.of(ASKEW, "the lamp"), Luminaire(octahedron)
    centre = place.point_to_world(np.array([octahedron.manifest.bounding_sphere.center]))[0]
    camera = np.eye(4)
    camera[:3, 3] = centre + np.array([0, 0, 2])
    wish = {
        "shader": str(tmp_path / "lamp.osl"), "output": "Radiance",
        "inputs": {"Incident": -1, "Dimmer": 0.5, "Tables": str(tmp_path / "tables.exr")},
        "positions": surface.positions.tolist(), "triangles": surface.triangles.tolist(),
        "to_world": ASKEW.tolist(), "camera": camera.tolist(), "ortho_scale": span,
        "width": size, "height": size,
    }  # fmt: skip
    found = osl_picture.picture(wish, tmp_path)
    along = ((np.arange(size) + 0.5) / size - 0.5) * span
    x, y = np.meshgrid(along, -along)
    origin = centre + np.stack((x, y, np.full_like(x, 2)), -1).reshape(-1, 3)
    down = np.tile(np.array([[0.0, 0, -1]]), (len(origin), 1))
    start, toward = place.point_to_local(origin), place.direction_to_local(down)
    hits = lamp.exit_surface.intersect(start, toward)
    expected = np.zeros((size * size, 3))
    expected[hits.ray] = 0.5 * lamp.radiance(hits.position, hits.normal, -toward[hits.ray])
    inner = expected.any(1) & found.reshape(-1, 3).any(1)  # Rims may fall either way.
    assert inner.sum() > 0.9 * expected.any(1).sum() > 50
    edge = np.abs(x.ravel()) + np.abs(y.ravel()) < 0.01  # Where four triangles meet.
    clear = inner & ~edge
    near = np.isclose(found.reshape(-1, 3)[clear], expected[clear], rtol=1e-3).all(1)
    assert near.mean() > 0.9  # Along edges the neighbour may be met.


def test_a_packed_table_is_refused(octahedron: Bundle, tmp_path: Path) -> None:
    files = contents(octahedron, "osl")
    assert b"shader purelight(" in files["lamp.osl"]
    assert "tables.exr" not in files  # So small a lamp has all of its numbers in the code.
