"""Normals that Mitsuba computes are the same at every load; those that a file states are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh


def settle(scene: Any) -> None:
    from purelight_train.light import vertex_normals

    vertex_normals.settle(scene)


def normals(mesh: Any) -> np.ndarray:
    import mitsuba as mi

    return np.array(mi.traverse(mesh)["vertex_normals"]).reshape(-1, 3)


def put(mesh: Any, value: np.ndarray) -> None:
    import mitsuba as mi

    parameters = mi.traverse(mesh)
    parameters["vertex_normals"] = mi.Float(value.astype(np.float32).ravel())
    parameters.update()


@pytest.fixture
def scene(mitsuba: Any, tmp_path: Path) -> Any:
    """A smooth ball of ten thousand vertices, a flat one, and one that is turned inside out."""
    ball = trimesh.creation.icosphere(5)
    path = tmp_path / "ball.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(ball, vertex_normal=False))
    shapes = {
        name: {"type": "ply", "filename": str(path), **told}
        for name, told in (
            ("smooth", {}), ("flat", {"face_normals": True}), ("flipped", {"flip_normals": True}),
        )
    }  # fmt: skip
    return mitsuba.load_dict({"type": "scene", **shapes})


def named(scene: Any, name: str) -> Any:
    return next(shape for shape in scene.shapes() if shape.id() == name)


@pytest.mark.parametrize("name", ["smooth", "flipped"])
def test_computed_normals_do_not_depend_on_the_order_of_their_sum(
    mitsuba: Any, scene: Any, name: str
) -> None:
    mesh = named(scene, name)
    settle(scene)
    first = normals(mesh)
    place = np.array(mitsuba.traverse(mesh)["vertex_positions"]).reshape(-1, 3)
    assert (np.einsum("nd,nd->n", first, place) > 0.999).all()
    noise = np.random.default_rng(0).normal(0, 1e-6, first.shape)
    put(mesh, first + noise)
    settle(scene)
    assert np.array_equal(normals(mesh), first)


def test_stated_normals_are_kept(scene: Any) -> None:
    """Where they are a ball's of another kind: all turned by a few degrees."""
    mesh = named(scene, "smooth")
    turned = normals(mesh) @ np.array([[1, 0.05, 0], [-0.05, 1, 0], [0, 0, 1]])
    turned = (turned / np.linalg.norm(turned, axis=1, keepdims=True)).astype(np.float32)
    turned = np.where(np.abs(turned[:, 2:]) < 0.9, turned, normals(mesh))
    put(mesh, turned)
    settle(scene)
    np.testing.assert_allclose(normals(mesh), turned, atol=2e-4)
    far = np.abs(turned[:, 2]) < 0.9
    assert np.array_equal(normals(mesh)[far], turned[far])


def test_flat_meshes_stay_flat(scene: Any) -> None:
    settle(scene)
    assert not named(scene, "flat").has_vertex_normals()
    assert not normals(named(scene, "flat")).size
