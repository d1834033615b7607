"""Rivals of the benchmark of systems, on a matt sphere whose light is a formula."""

from __future__ import annotations

import json
import types
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Subject
from benchmarks.systems.rivals import RIVALS
from benchmarks.systems.rivals.ies import Ies, light_centre
from benchmarks.systems.rivals.rays import Rays
from purelight_examples.scenes.lamp_choice import move
from purelight_export.photometry import ies_file, intensity
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.members.surface import Surface
from tests.support import analytic_lamps
from tests.unit.benchmarks import rival_floor
from tests.unit.benchmarks.rival_floor import CENTRE, FLUX, RADIUS, Floor


def error(image: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Ratio of the means [3], and relative root mean square error over the brighter pixels."""
    truth = Floor().truth()
    bright = truth.sum(-1) > 0.2 * truth.sum(-1).max()
    ratio = image[bright] / truth[bright]
    return image[bright].mean(0) / truth[bright].mean(0), float(np.sqrt(((ratio - 1) ** 2).mean()))


def picture(system: MitsubaSystem, subject: Subject, folder: Path, spp: int) -> NDArray[np.float64]:
    """A rendering in this process."""
    (frame,) = system.rendered(subject, Floor(), folder, [spp], 0)
    assert frame.samples == spp
    assert frame.seconds > 0
    return frame.image


@pytest.fixture
def exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Subject:
    """The sphere as a bundle, with its IES file and a run's record of the seconds."""
    subject = rival_floor.subject(tmp_path)
    mesh = trimesh.creation.icosphere(3, RADIUS).apply_translation(CENTRE)
    positions, faces = mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)
    flux = np.tile(np.array(FLUX) / len(faces), (len(faces), 1)).astype(np.float32)
    networks = {"appearance": analytic_lamps.appearance()}
    lamp = analytic_lamps.Lamp(Surface(positions, faces, flux), networks, np.array(FLUX))
    monkeypatch.setattr(analytic_lamps, "SPHERE", BoundingSphere(CENTRE, 1.01 * RADIUS))
    lamp.write(subject.bundle)
    directions = np.random.default_rng(0).normal(size=(1 << 20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    table = intensity(directions, np.ones_like(directions), FLUX)
    text = ies_file(table, name="lamp", issued="2026-01-01", radius=RADIUS)
    subject.bundle.with_suffix(".ies").write_bytes(text)
    subject.run.mkdir()
    (subject.run / "metrics.json").write_text(json.dumps({"seconds": {"light": 12.5}}))
    return subject


def test_names_are_unique_words() -> None:
    names = [system.name for system in RIVALS]
    assert len(set(names)) == len(names)
    assert all(name.replace("_", "").isalnum() for name in names)
    assert all(set(system.answers) <= {"illumination", "appearance"} for system in RIVALS)


def test_ies_light(exported: Subject, tmp_path: Path) -> None:
    folder, system = tmp_path / "ies", Ies()
    cost = system.prepare(exported, folder)
    assert cost.seconds == 12.5
    assert cost.megabytes == exported.bundle.with_suffix(".ies").stat().st_size / 1e6
    assert np.allclose(light_centre(exported.bundle), CENTRE, atol=1e-4)
    ratio, rms = error(picture(system, exported, folder, 16))
    assert np.abs(ratio - 1).max() < 0.01
    assert rms < 0.05


def test_what_a_rival_has_of_our_training_is_told_by_the_processor(
    exported: Subject, tmp_path: Path
) -> None:
    """Stages of a run are told by the clock, which a busy machine stretches."""
    stages = {"light": 12.5, "student": 30.0, "sampler": 7.5}
    (exported.run / "metrics.json").write_text(json.dumps({"seconds": stages}))
    told = {"training": 25.0, "export": 3.0}
    exported.bundle.with_name("training.json").write_text(json.dumps(told))
    assert Ies().prepare(exported, tmp_path / "ies").seconds == pytest.approx(6.25)


def test_ies_flux_grows_with_the_square_of_the_size(exported: Subject, tmp_path: Path) -> None:
    system, folder, light = Ies(), tmp_path / "ies", []
    system.prepare(exported, folder)
    system.register()
    for scale in (1.0, 3.0):
        element = system.lamp(exported, folder).elements(folder, (0, 0, 0))[0]
        move(element, (0.0, 0.0, 0.0), scale)
        scene = ET.Element("scene", version="3.0.0")
        scene.append(element)
        ET.ElementTree(scene).write(folder / "light.xml")
        emitter = mi.load_file(str(folder / "light.xml")).emitters()[0]
        ds, value = emitter.sample_direction(dr_point((0.0, 0.0, -10.0)), mi.Point2f(0.5), True)
        light.append(np.array(value).ravel() * float(ds.dist[0]) ** 2)
    assert np.allclose(light[1], 9 * light[0], rtol=0.05)
    assert np.allclose(light[0], np.array(FLUX) / (4 * np.pi), rtol=0.1)


def dr_point(at: tuple[float, float, float]) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.p = mi.Point3f(*at)
    return si


def test_ies_without_its_file(exported: Subject, tmp_path: Path) -> None:
    exported.bundle.with_suffix(".ies").unlink()
    with pytest.raises(PureLightError, match="purelight-export writes it"):
        Ies().prepare(exported, tmp_path / "ies")


def test_rays(tmp_path: Path) -> None:
    subject, system = rival_floor.subject(tmp_path), Rays(200_000)
    cost = system.prepare(subject, tmp_path)
    size = (tmp_path / "lamp.tm25ray").stat().st_size
    assert cost.megabytes == size / 1e6
    assert size > 200_000 * 28
    assert cost.seconds > 0
    again = system.prepare(subject, tmp_path)
    assert again.seconds == cost.seconds
    ratio, rms = error(picture(system, subject, tmp_path, 1 << 13))
    assert np.abs(ratio - 1).max() < 0.02
    assert rms < 0.12


def test_rays_of_an_enlarged_lamp_have_more_power(tmp_path: Path) -> None:
    subject, system = rival_floor.subject(tmp_path), Rays(1000)
    system.prepare(subject, tmp_path)
    mi.set_variant("llvm_ad_rgb")
    system.register()
    text = (
        '<scene version="3.0.0"><emitter type="benchmark_rays"><string name="filename" '
        f'value="{tmp_path / "lamp.tm25ray"}"/><transform name="to_world"><scale value="2"/>'
        "</transform></emitter></scene>"
    )
    emitter = mi.load_string(text).emitters()[0]
    u = np.random.default_rng(0).random((3, 1 << 14)).astype(np.float32)
    point = mi.Point2f(u[1], u[2])
    _, weight = emitter.sample_ray(0.0, mi.Float(u[0]), point, point, True)
    assert np.allclose(np.array(weight).mean(1), 4 * np.array(FLUX), rtol=0.02)


def test_a_bundle_with_other_networks(exported: Subject, tmp_path: Path) -> None:
    from benchmarks.systems.rivals.rebundle import with_networks

    brighter = analytic_lamps.appearance(tilt=0.5)
    with_networks(exported.bundle, tmp_path / "other.plux", {"appearance": brighter})
    other = Bundle.open(tmp_path / "other.plux")
    assert other.read("networks/appearance.onnx") == brighter
    assert other.manifest.flux == Bundle.open(exported.bundle).manifest.flux


def test_seconds_of_interrupted_work_count(tmp_path: Path) -> None:
    from benchmarks.systems.rivals.accounts import Account

    def interrupted() -> None:
        with Account(tmp_path).stage("light"):
            sum(range(1 << 20))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    first = Account(tmp_path).total
    assert first > 0
    with Account(tmp_path).stage("light"):
        sum(range(1 << 20))
    assert Account(tmp_path).total > first


# Proxies


def test_light_on_a_sphere_around_the_lamp_is_all_of_it(tmp_path: Path) -> None:
    import torch

    from benchmarks.systems.rivals.proxy import ProxyLamp, sphere_around
    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.runs.stages import Stages

    subject = rival_floor.subject(tmp_path)
    run = RunDirectory(tmp_path / "proxy")
    lamp = ProxyLamp(subject.scene, 1 << 18, Stages(run, 0, torch.device("cpu"), ("light",)))
    lamp.around = sphere_around  # type: ignore[method-assign]
    records = lamp.records
    assert np.allclose(records.flux, FLUX, rtol=0.01)
    away = np.linalg.norm(records.position - np.array(CENTRE), axis=1)
    assert away.min() > RADIUS
    assert away.max() < 1.01 * RADIUS
    assert lamp.description.sphere.radius == pytest.approx(1.004 * RADIUS, rel=2e-3)


def test_path_traced_targets_of_the_sphere(tmp_path: Path) -> None:
    from benchmarks.systems.rivals.path_traced import path_traced

    scene = mi.load_file(str(rival_floor.subject(tmp_path).scene))
    origin = np.array(CENTRE) + np.array([[0, 0, 1.0], [0, 0.5, 1.0]])
    down = np.array([[0, 0, -1.0], [0, 0, -1.0]])
    seen = path_traced(scene, origin.astype(np.float32), down.astype(np.float32), 0, samples=4)
    assert np.allclose(seen, [rival_floor.RADIANCE, (0, 0, 0)])


# The paper's histogram


def test_histogram_graph_is_the_module() -> None:
    import torch

    from benchmarks.systems.rivals import histogram_graph
    from purelight_onnx.session import Session
    from purelight_train.ablations.histogram_sampler import HistogramSampler
    from tests.support.untrained import SPHERE, wild

    network = wild(HistogramSampler)
    rng = np.random.default_rng(3)
    direction = rng.normal(size=(512, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    point = (np.array(SPHERE.center) + direction * rng.uniform(0.3, 2, (512, 1))).astype(np.float32)
    u = rng.random((512, 2)).astype(np.float32)
    with torch.no_grad():
        toward, pdf = network(torch.from_numpy(point), torch.from_numpy(u))
    drawn = Session(histogram_graph.sampler(network), name="sampler")({"point": point, "u": u})
    same = np.abs(drawn["toward"] - toward.numpy()).max(1) < 1e-3
    assert same.mean() > 0.99  # at the cells' borders rounding decides
    assert np.allclose(drawn["pdf_solid_angle"][same], pdf.numpy()[same], rtol=2e-2)
    told = Session(histogram_graph.sampler_pdf(network), name="pdf")(
        {"point": point, "toward": toward.numpy()}
    )["pdf_solid_angle"]
    close = np.isclose(told, pdf.numpy(), rtol=2e-2)
    assert close.mean() > 0.97


# LuxCore

GLASS = """
  <shape type="sphere"><float name="radius" value="0.05"/><point name="center" value="{centre}"/>
    <bsdf type="roughdielectric"><string name="distribution" value="ggx"/>
      <float name="alpha" value="0.3"/>
      <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
  <shape type="sphere"><float name="radius" value="0.045"/><point name="center" value="{centre}"/>
    <boolean name="flip_normals" value="true"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/>
      <float name="ext_ior" value="1"/></bsdf></shape>""".format(centre=", ".join(map(str, CENTRE)))


def lux(subject: Subject, folder: Path, spp: int) -> NDArray[np.float64]:
    """A rendering by LuxCore in its own process."""
    pytest.importorskip("pyluxcore", reason="pyluxcore is not installed")
    from benchmarks.systems.rivals.bidirectional.system import Bidirectional

    system = Bidirectional()
    assert system.prepare(subject, folder).seconds == 0
    (frame,) = system.frames(subject, Floor(), folder, [spp], 0)
    assert frame.samples >= spp
    assert frame.processor is not None  # what other work on the machine does not stretch
    assert 0 < frame.processor < 2 * frame.seconds + 1
    return frame.image


def test_bidirectional_on_a_floor_under_a_sphere(tmp_path: Path) -> None:
    ratio, rms = error(lux(rival_floor.subject(tmp_path), tmp_path, 512))
    assert np.abs(ratio - 1).max() < 0.02
    assert rms < 0.08


def test_a_quick_bidirectional_has_two_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A small picture has more than all samples when LuxCore is first looked at."""
    from benchmarks.systems.rivals.bidirectional import rendering

    made = iter((7.0, 15.0, 31.0))
    session = types.SimpleNamespace(Start=lambda: None)
    monkeypatch.setattr(rendering, "_library", lambda: None)
    monkeypatch.setattr(rendering, "_session", lambda *_: (1, 1, session))
    monkeypatch.setattr(rendering, "_wait", lambda _, samples: (next(made), 0.1))
    monkeypatch.setattr(rendering, "_picture", lambda *_: np.ones((1, 1, 3)))
    found = list(rendering.frames(tmp_path, [1, 2, 4, 8], 0, 1))
    assert [frame.samples for frame in found] == [7, 15]


SIDES = [("0", False, True), ("180", False, False), ("0", True, False), ("180", True, True)]


@pytest.mark.parametrize(("angle", "flipped", "dark"), SIDES)
def test_lights_shine_to_the_side_of_their_normals(
    angle: str, flipped: bool, dark: bool, tmp_path: Path
) -> None:
    """As the mesh that LuxCore is given has it: the winding of its faces says where it shines."""
    from benchmarks.systems.rivals.bidirectional.conversion import convert

    more = f"""<sensor type="perspective"/><shape type="rectangle">
      <boolean name="flip_normals" value="{str(flipped).lower()}"/>
      <transform name="to_world"><rotate x="1" angle="{angle}"/></transform>
      <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"""
    scene = mi.load_file(str(rival_floor.subject(tmp_path, more).scene), optimize=False)
    convert(scene, tmp_path, seen=False)
    with np.load(tmp_path / "meshes.npz") as meshes:
        a, b, c = meshes["shape1.vertices"][meshes["shape1.faces"][0]]
    up = np.cross(b - a, c - a)[2] > 0
    assert up == dark


def test_bidirectional_through_a_glass_globe(tmp_path: Path) -> None:
    from benchmarks.systems.own import LightTracing

    subject = rival_floor.subject(tmp_path, GLASS, radius=0.02)
    image = lux(subject, tmp_path, 2048)
    traced = picture(LightTracing(), subject, tmp_path / "mitsuba", 1 << 13)
    bright = traced.sum(-1) > 0.2 * traced.sum(-1).max()
    # LuxCore has another shadowing (2 % here) and no seed: 1.009 to 1.025 was seen, and 0.06
    assert np.allclose(image[bright].mean(0) / traced[bright].mean(0), 1, atol=0.05)
    assert np.median(np.abs(image[bright] / traced[bright] - 1)) < 0.12


@pytest.mark.parametrize(
    ("bsdf", "message"),
    [
        ('<bsdf type="roughplastic"/>', "no material like RoughPlastic of shape"),
        ('<bsdf type="thindielectric"/>', "no material like ThinDielectric of shape"),
        ('<bsdf type="roughconductor"/>', "no Beckmann distribution"),
    ],
)
def test_what_luxcore_has_not_is_refused(bsdf: str, message: str, tmp_path: Path) -> None:
    from benchmarks.systems.rivals.bidirectional.conversion import convert

    more = f'<shape type="sphere">{bsdf}</shape><sensor type="perspective"/>'
    scene = mi.load_file(str(rival_floor.subject(tmp_path, more).scene), optimize=False)
    with pytest.raises(PureLightError, match=message):
        convert(scene, tmp_path, seen=False)
    assert not (tmp_path / "scene.json").exists()


def test_rough_glass_is_not_looked_at(tmp_path: Path) -> None:
    from benchmarks.systems.rivals.bidirectional.conversion import convert

    more = GLASS + '<sensor type="perspective"/>'
    scene = mi.load_file(str(rival_floor.subject(tmp_path, more).scene), optimize=False)
    convert(scene, tmp_path, seen=False)
    with pytest.raises(PureLightError, match="rough glass brighter"):
        convert(scene, tmp_path, seen=True)


# Wavelets


def random_bins() -> Any:
    from benchmarks.systems.rivals.wcl.bins import Bins, Box

    box = Box(np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.4, 0.3]))
    return Bins(box, np.random.default_rng(0).random((6, 4, 4, 8, 8, 3)))


def test_the_box_is_closed_and_faces_outwards() -> None:
    box = random_bins().box
    mesh = box.mesh()
    assert mesh.area == pytest.approx(box.areas.sum())
    assert mesh.volume == pytest.approx(8 * box.half.prod())


def test_the_table_gives_a_bin_at_its_middle() -> None:
    import torch

    from benchmarks.systems.rivals.wcl.bins import coordinates
    from benchmarks.systems.rivals.wcl.table import Table, appearance
    from purelight_format.measures import square_to_disk

    bins, face = random_bins(), np.arange(6)
    axis, sign = face // 2, 1 - 2 * (face % 2)
    normal, position, outgoing = (np.zeros((6, 3)) for _ in range(3))
    disk = square_to_disk(np.array([[2.5 / 8, 5.5 / 8]]))[0]
    for k in range(2):
        along = (axis + 1 + k) % 3
        position[face, along] = 2 * ((1.5, 3.5)[k] / 4) - 1
        outgoing[face, along] = disk[k]
    normal[face, axis] = position[face, axis] = sign
    outgoing[face, axis] = sign * np.sqrt(1 - (disk**2).sum())
    position = position * bins.box.half + bins.box.centre
    rays = [a.astype(np.float32) for a in (position, normal, outgoing)]
    found, square = coordinates(bins.box, *rays)
    assert found.tolist() == face.tolist()
    assert np.allclose(square * [4, 4, 8, 8], [1.5, 3.5, 2.5, 5.5], atol=1e-5)
    told = Table(appearance(bins))(*map(torch.from_numpy, rays)).numpy()
    assert np.allclose(told, bins.values[face, 1, 3, 2, 5], rtol=1e-5)


def test_wavelets_keep_the_flux_within_the_budget() -> None:
    pytest.importorskip("pywt", reason="PyWavelets is not installed")
    from benchmarks.systems.rivals.wcl.wavelets import compress

    bins = random_bins()
    whole = compress(bins, 1 << 30)
    assert np.allclose(whole.bins.values, bins.values, atol=2e-3)
    part = compress(bins, 4000)
    assert 3500 < len(part.data) <= 4000
    assert part.kept < 0.2
    assert np.allclose(part.bins.flux, bins.flux)
    assert np.allclose(bins.filtered(1.0).flux, bins.flux)
    worse = np.abs(part.bins.values - bins.values).mean()
    assert 0.05 < worse < 0.25


def test_bins_of_light_have_its_flux(tmp_path: Path) -> None:
    import torch

    from benchmarks.systems.rivals.proxy import ProxyLamp
    from benchmarks.systems.rivals.wcl.bins import Bins, Box
    from benchmarks.systems.rivals.wcl.table import Table, appearance
    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.runs.stages import Stages

    subject = rival_floor.subject(tmp_path)
    stages = Stages(RunDirectory(tmp_path / "wcl"), 0, torch.device("cpu"), ("light",))
    lamp = ProxyLamp(subject.scene, 1 << 20, stages)
    lamp.around = lambda surface: Box.around(surface).mesh()  # type: ignore[method-assign]
    box = Box.of(lamp.surface)
    bins = Bins.of(box, lamp.records, 4, 8)
    assert np.allclose(bins.flux, FLUX, rtol=0.01)
    # Straight out of the middle of the lowest face: the sphere's own radiance
    at = box.centre - [0, 0, box.half[2]]
    rays = [torch.tensor(np.array([v]), dtype=torch.float32) for v in (at, [0, 0, -1], [0, 0, -1])]
    seen = Table(appearance(bins.filtered(0.5)))(*rays)[0].numpy()
    assert np.allclose(seen, rival_floor.RADIANCE, rtol=0.2)
