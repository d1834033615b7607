"""Measured rays as a lamp: where they leave it, what is held out, how well they know it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import file_of
from purelight_format.ray_file.files import write_ray_file
from purelight_format.ray_file.rays import Rays
from purelight_mitsuba.platform import use
from tests.support.rays import ball, disc

use()

from purelight_train.light import measured_luminaire  # noqa: E402
from purelight_train.light.exit_records import settle  # noqa: E402
from purelight_train.light.measured_luminaire import load_measured  # noqa: E402
from purelight_train.light.virtual_surface import nearest_to_focus, virtual_surface  # noqa: E402
from purelight_train.truth.counting import counting_errors  # noqa: E402


def put(rays: Rays, folder: Path, name: str = "lamp.tm25ray") -> Path:
    write_ray_file(folder / name, file_of(rays, "lamp"))
    return folder / name


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_a_hull_fits_a_ball(scale: float) -> None:
    lamp = ball(20_000)
    rays = Rays(lamp.position * np.float32(scale), lamp.direction, lamp.power)
    positions, triangles, kind = virtual_surface(rays)
    assert kind == "start"
    mesh = trimesh.Trimesh(positions / scale, triangles, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0  # Wound outwards.
    assert mesh.area == pytest.approx(4 * np.pi * 0.05**2, rel=0.02)
    assert mesh.contains(lamp.position.astype(np.float64)).all()


def test_a_flat_source_gets_a_thin_hull() -> None:
    positions, triangles, _ = virtual_surface(disc())
    mesh = trimesh.Trimesh(positions, triangles, process=False)
    assert np.ptp(positions, axis=0)[2] < 0.01 * np.ptp(positions, axis=0)[0]
    assert mesh.area / 2 == pytest.approx(np.pi * 2e-3**2, rel=0.03)


def test_rays_from_far_around_get_a_tight_hull() -> None:
    near, far = ball(), ball(away=1.0)
    assert np.linalg.norm(nearest_to_focus(far) - np.array([0.1, 0.2, 0.3]), axis=1).max() < 0.0501
    positions, _, kind = virtual_surface(far)
    assert kind == "tight"
    assert np.ptp(positions, axis=0).max() < 1.1 * np.ptp(near.position, axis=0).max()
    assert virtual_surface(far, "start")[2] == "start"


def test_a_point_has_no_radiance() -> None:
    rays = ball(2000)
    with pytest.raises(PureLightError, match="pass one point"):
        virtual_surface(Rays(0 * rays.position, rays.direction, rays.power))


def test_light_leaves_where_its_ray_meets_the_hull(tmp_path: Path) -> None:
    lamp = load_measured(put(ball(), tmp_path))
    records = lamp.records
    np.testing.assert_allclose(records.flux, [3, 2, 1], rtol=1e-3)
    off = np.linalg.norm(records.position - np.array([0.1, 0.2, 0.3]), axis=1)
    assert 0.049 < off.min() < off.max() < 0.0515
    assert (np.einsum("nd,nd->n", records.normal, records.direction) > 0).all()
    settled, _ = settle(records, lamp.exit_surface)
    assert len(settled) == pytest.approx(len(records), rel=1e-3)


def test_what_is_held_out_is_never_traced(tmp_path: Path) -> None:
    lamp = load_measured(put(ball(), tmp_path))
    kept = {tuple(row) for row in lamp.held_out(0).direction.tolist()}
    assert len(kept) == 2000
    for seed in range(3):
        part = lamp.trace(5000, seed)
        assert len(part) == 5000
        assert not kept & {tuple(row) for row in part.direction.tolist()}
        np.testing.assert_allclose(part.flux, [3, 2, 1], rtol=1e-3)
    assert len(lamp.trace(1 << 20, 0)) == 18_000
    assert lamp.is_scarce(50_000)
    assert not lamp.is_scarce(30_000)


def test_errors_are_those_of_a_count(tmp_path: Path) -> None:
    """Against many sets of rays of the same lamp: how much their fluxes into a band vary."""
    lamp = load_measured(put(ball(10_000), tmp_path))
    np.testing.assert_allclose(lamp.records.flux_error / lamp.records.flux, 0.01, rtol=1e-3)
    found = counting_errors(lamp.records, lamp.exit_surface.sphere)["relative_error"]
    assert found["flux"] == pytest.approx(0.01, rel=0.01)
    counts = []
    for seed in range(200):
        z = ball(10_000, seed=seed).direction[:, 2]
        counts.append(((z > 0.5) & (z < 0.625)).sum() / 12)  # Of 192 zones, the mean of a row.
    assert np.std(counts) * np.sqrt(12) / np.mean(counts) == pytest.approx(
        found["intensity"]["median"], rel=0.2
    )


def test_a_mesh_may_be_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured_luminaire, "VISIBILITY_RAYS", 1 << 16)
    mesh = trimesh.creation.icosphere(4, 0.06)
    mesh.apply_translation([0.1, 0.2, 0.3])
    mesh.export(tmp_path / "globe.ply")
    lamp = load_measured(put(ball(), tmp_path), surface=str(tmp_path / "globe.ply"))
    off = np.linalg.norm(lamp.records.position - np.array([0.1, 0.2, 0.3]), axis=1)
    np.testing.assert_allclose(off, 0.06, rtol=0.01)
    assert lamp.facts()["exit_surface"] == "globe.ply"
    mesh.apply_scale(0.1)
    mesh.export(tmp_path / "globe.ply")
    with pytest.raises(PureLightError, match=r"passes beside globe\.ply"):
        load_measured(tmp_path / "lamp.tm25ray", surface=str(tmp_path / "globe.ply"))
    (tmp_path / "globe.ply").write_text("no mesh")
    with pytest.raises(PureLightError, match=r"globe.ply: (not a mesh|holds no)"):
        load_measured(tmp_path / "lamp.tm25ray", surface=str(tmp_path / "globe.ply"))


def test_few_rays_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="999 rays; 1000 are the least"):
        load_measured(put(ball(999), tmp_path))


def test_what_a_header_gets_wrong_is_a_warning(tmp_path: Path) -> None:
    path = put(ball(), tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_measured(path)
    data = bytearray(path.read_bytes())
    data[12:16] = np.float32(1).tobytes()
    path.write_bytes(data)
    with pytest.warns(UserWarning, match="header says 1 lumens"):
        load_measured(path)


def test_the_report_compares_student_and_rays_in_candela() -> None:
    """Of a ball that shines evenly, and a student that is right."""
    import trimesh

    from purelight_train.learning.density_tree import DensityTree
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.exit_records import ExitRecords
    from purelight_train.light.exit_surface import ExitSurface
    from purelight_train.light.ray_chart import RayChart
    from purelight_train.report.measured import MeasuredLight

    made, rng, count = trimesh.creation.icosphere(subdivisions=3), np.random.default_rng(0), 100_000
    faces = made.faces.astype(np.uint32)
    surface = ExitSurface(made.vertices.astype(np.float32), faces, np.zeros(len(faces), bool))
    tree = DensityTree.of(rng.random((1000, 4)), np.ones(1000))
    position, normal, outgoing = surface.sample_rays(count, rng)
    records = ExitRecords(
        position=position, normal=normal, shading=normal, direction=outgoing,
        weight=np.full((count, 3), np.pi * surface.area, np.float32),
        free=np.full(count, np.inf, np.float32), bare=np.zeros(count, bool), paths=count,
        counted=True,
    )  # fmt: skip
    references = ReferenceRays(RayChart(surface), tree)
    light = MeasuredLight({}, records, references, lambda p, n, o: np.ones_like(p))
    for _, rays, _, student, difference in light._bands().rows:
        seen, told = (float(cell.split()[0]) for cell in (rays, student))
        assert told == pytest.approx(seen, rel=0.05)
        assert abs(float(difference.split("(")[1].split()[0])) < 5
