"""How near a bundle is to the lamp it was made from: flux, irradiance, look, sampler, hosts.

Every figure compares the bundle, through a public runtime, with something no network made.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats.qmc import Sobol

from purelight_export import photometry
from purelight_format import measures
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_mitsuba.scene_file import load_scene
from purelight_onnx.luminaire import Luminaire
from purelight_train.learning.cap_samples import shading_points
from purelight_train.learning.teacher import Teacher
from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.light_tracing import trace_records
from purelight_train.light.radiance_field import look
from purelight_train.runs.pipeline import reopen
from purelight_train.runs.progress import Bar
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.truth.far_field import IntensityZones, interpolate
from purelight_train.truth.light_traced import light_traced, sharp_share
from purelight_train.truth.metrics import Comparison, Mask
from purelight_train.truth.picture import Picture
from purelight_train.truth.plane import Plane, plane_irradiance
from purelight_train.truth.thin_lens import ThinLens, aperture_for
from purelight_train.truth.views import field_view, three_views

FLOOR_ALBEDO = 0.01
PASS, PASSES = 1 << 18, (8, 64)  # samples of the flux; least and most passes
CHUNK = 1 << 23  # paths whose records are held at once
Figures = dict[str, Any]
Image = NDArray[np.float64]


@dataclass(frozen=True)
class Subject:
    """A lamp's scene, the run that learned it, and the bundle that came out.

    Arguments:
        threads: that ONNX Runtime may use.
    """

    scene: Path
    run: Path
    bundle: Path
    threads: int = 2

    @cached_property
    def lamp(self) -> Any:
        return load_scene(self.scene)

    @cached_property
    def description(self) -> Description:
        return RunDirectory.open(self.run).description

    @cached_property
    def luminaire(self) -> Luminaire:
        return Luminaire.open(self.bundle, threads=self.threads)

    @cached_property
    def surface(self) -> ExitSurface:
        """The bundle's surface, which does not say what is seen from both sides: all may be."""
        surface = self.luminaire.bundle.surface()
        two_sided = np.ones(len(surface.triangles), bool)
        return ExitSurface(surface.positions, surface.triangles, two_sided)

    @cached_property
    def teacher(self) -> Teacher | None:
        """The run's teacher; None where it was trained without."""
        run = RunDirectory.open(self.run)
        if not run.finished("teacher"):
            return None
        return reopen(run, self.scene).teacher

    def radiance(self, *query: NDArray[np.float32]) -> NDArray[np.float32]:
        """Radiance through the ONNX runtime."""
        return self.luminaire.radiance(*query).astype(np.float32)

    def transmittance(self, *query: NDArray[np.float32]) -> NDArray[np.float32]:
        """Transmittance through the ONNX runtime, zero for a lamp that no light passes."""
        if not self.luminaire.has("transparency"):
            return np.zeros_like(query[0])
        return self.luminaire.transmittance(*query).astype(np.float32)


def flux(subject: Subject) -> Figures:
    """Flux of the bundle through a sphere around it, and of the IES file, over the truth.

    Channels without light have none.
    """
    student, error = sphere_flux(subject)
    true = np.asarray(subject.description.flux)

    def over(value: NDArray[np.float64]) -> list[float | None]:
        return [float(v / t) if t > 0 else None for v, t in zip(value, true, strict=True)]

    return {
        "student_over_traced": over(student),
        "standard_error": over(error),
        "ies_over_traced": ies_lumens(subject.bundle.with_suffix(".ies"))
        / (683 * true @ LUMINANCE),
    }


def sphere_flux(
    subject: Subject, radii: float = 3.0, precision: float = 5e-4
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    r"""Light through a sphere around the lamp, and its standard error: two of [3] in W.

    :math:`\Phi = \int_A \int L \cos\theta\,d\omega\,dA` over points of the sphere and directions
    that the bundle's sampler draws, by Sobol points scrambled anew in each pass: the passes are
    independent, and their spread is the error. `PASSES` gives the least number and the most; in
    between, it ends once the error is small enough.
    """
    flux: list[NDArray[np.float64]] = []
    for number in range(PASSES[1]):
        flux.append(_through_sphere(subject, radii, number))
        if len(flux) < PASSES[0]:
            continue
        error = np.std(flux, axis=0, ddof=1) / math.sqrt(len(flux))
        if (error <= precision * np.mean(flux, axis=0)).all():
            break
    return np.mean(flux, axis=0), error


def _through_sphere(subject: Subject, radii: float, seed: int) -> NDArray[np.float64]:
    """One pass's flux, in W: [3]."""
    sphere = subject.description.sphere
    u = Sobol(4, seed=seed).random(PASS)
    outward = _on_unit_sphere(u[:, :2])
    distance = radii * sphere.radius
    point = (np.asarray(sphere.center) + distance * outward).astype(np.float32)
    toward, pdf = subject.luminaire.sample(point, u[:, 2:].astype(np.float32))
    seen = look(subject.surface, subject.radiance, point, toward.astype(np.float32))
    cosine = -np.einsum("nd,nd->n", toward, outward)
    estimates = 4 * math.pi * distance**2 * seen * (cosine / pdf)[:, None]
    return estimates.mean(0, dtype=np.float64)


def _on_unit_sphere(u: Image) -> Image:
    """Even points on the unit sphere, z = 1 - 2 u: [N, 2] to [N, 3]."""
    z, turn = 1 - 2 * u[:, 0], 2 * math.pi * u[:, 1]
    ring = np.sqrt(np.maximum(1 - z**2, 0))
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


def ies_lumens(path: Path) -> float:
    """Lumens of an IES file as a photometric tool reads it.

    Raises:
        PureLightError: it is not there.
    """
    from photompy import IESFile

    if not path.is_file():
        raise PureLightError(f"{path}: no such file; purelight-export writes it")
    return float(IESFile.read(path).photometry.total_optical_power())


def irradiance(subject: Subject, spp: int = 1 << 13, paths: int = 1 << 26) -> Figures:
    """Irradiance on a plane 1 m below the lamp: rendered in both modes over light-traced."""
    plane = Plane.below(subject.description.sphere)
    true, noise = traced_plane(subject.lamp, plane, paths, 77)
    figures: Figures = {"truth_noise": float(noise.mean() / true.mean())}
    for mode in ("accurate", "fast"):
        figures[mode] = plane_errors(plane_render(subject, plane, mode, spp), true)
    return figures


def traced_plane(scene: Any, plane: Plane, paths: int, seed: int) -> tuple[Image, Image]:
    """`plane_irradiance` of as many paths as one likes: mean and standard error."""
    count = -(-paths // CHUNK)
    means, squares = np.zeros((2, plane.cells, plane.cells, 3))
    for part in range(count):
        records = trace_records(scene, min(paths, CHUNK), seed + part)
        mean, error = plane_irradiance(records, plane)
        means += mean / count
        squares += (error / count) ** 2
    return means, np.sqrt(squares)


def plane_errors(rendered: Image, true: Image) -> Figures:
    """Relative error of the mean irradiance, and mean absolute error of the cells over it."""
    return {
        "mean": float(rendered.mean() / true.mean() - 1),
        "mean_absolute_over_mean": float(np.abs(rendered - true).mean() / true.mean()),
    }


def plane_render(subject: Subject, plane: Plane, mode: str, spp: int) -> Image:
    """Irradiance on a plane through the integrator `purelight`: [cells, cells, 3] by [y, x]."""
    lamp = {"type": "purelight", "filename": str(subject.bundle.resolve())}
    integrator = {"type": "purelight", "mode": mode, "max_depth": 2}
    return floor_irradiance({"lamp": lamp}, integrator, plane, spp)


def floor_irradiance(
    lamp: dict[str, Any], integrator: dict[str, Any], plane: Plane, spp: int, seed: int = 3
) -> Image:
    """Direct irradiance on a plane in a rendering: [cells, cells, 3] by [y, x] in W/m².

    A camera between plane and lamp looks down at a diffuse floor, whose radiance is albedo E / pi.
    It is so dark that what it sends back to a real lamp and gets again does not count.

    Arguments:
        lamp: objects that make up the lamp.
    """
    scene = mi.load_dict({
        "type": "scene",
        "integrator": integrator,
        "sensor": _down(plane),
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate(list(plane.center)).scale(plane.side),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": FLOOR_ALBEDO}},
        },
        **lamp,
    })  # fmt: skip
    image = np.array(mi.render(scene, spp=spp, seed=seed)).astype(np.float64)[..., :3]
    return math.pi / FLOOR_ALBEDO * image[::-1]  # rows from the top of the picture, which is +y


def _down(plane: Plane) -> dict[str, Any]:
    """A camera a quarter of a plane's side above it, which the plane fills.

    A pinhole's pictures of planes across its axis are even; light tracers know no orthographic one.
    """
    height = 0.25 * plane.side
    centre = np.asarray(plane.center)
    film = {
        "type": "hdrfilm", "width": plane.cells, "height": plane.cells,
        "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32",
    }  # fmt: skip
    view = mi.ScalarTransform4f().look_at(
        list(centre + np.array([0, 0, height])), list(centre), [0, 1, 0]
    )
    return {
        "type": "perspective", "to_world": view, "film": film,
        "fov": math.degrees(2 * math.atan(0.5 * plane.side / height)),
        "near_clip": 1e-2 * height, "far_clip": 1e3 * height,
    }  # fmt: skip


@dataclass(frozen=True)
class View:
    """The lamp through one lens: the truth, what the student shows, and where the lamp is."""

    lens: ThinLens
    truth: Picture
    student: Picture
    mask: Mask


def views(subject: Subject, size: int, paths: int, spp: int) -> list[View]:
    """Three views, light traced and as the student shows them."""
    share = sharp_share(subject.lamp)
    lenses = three_views(ThinLens(subject.description.sphere, size, 0, 0, aperture_for(share)))
    with Bar("truth", paths, "path", lambda _: None) as update:
        truths = light_traced(subject.lamp, lenses, paths, 11, update)
    made = []
    for lens, truth in zip(lenses, truths, strict=True):
        rng = np.random.default_rng(2)
        student, mask = field_view(subject.surface, subject.radiance, lens, spp, rng)
        made.append(View(lens, truth, student, mask))
    return made


def appearance(subject: Subject, size: int = 128, paths: int = 1 << 26, spp: int = 16) -> Figures:
    """Error of three views: student and teacher against the truth, and student against teacher.

    The truth is light traced through a thin lens, and so are its rivals' rays.

    Arguments:
        paths: of the truth; its own error is among the figures.
        spp: rays through a pixel of student and teacher.
    """
    seen = views(subject, size, paths, spp)
    errors = [view_errors(subject, view, spp) for view in seen]
    return {
        "aperture": seen[0].lens.aperture,
        **{pair: _mean([view[pair] for view in errors]) for pair in errors[0]},
        "views": errors,
    }


def view_errors(subject: Subject, view: View, spp: int) -> Figures:
    """Comparisons of one view, with the teacher where there is one."""
    pairs = {"student_truth": (view.student, view.truth)}
    teacher = subject.teacher
    if teacher is not None:
        rng = np.random.default_rng(3)  # noise of its own
        taught, _ = field_view(teacher.surface, teacher.radiance, view.lens, spp, rng)
        pairs |= {"teacher_truth": (taught, view.truth), "student_teacher": (view.student, taught)}
    return {k: Comparison(*pair, view.mask).to_dict() for k, pair in pairs.items()}


def _mean(figures: list[dict[str, float]]) -> dict[str, float]:
    """Each figure's mean over the views."""
    return {k: float(np.mean([f[k] for f in figures])) for k in figures[0]}


def far_field(subject: Subject, paths: int = 1 << 24) -> Figures:
    """The table of the exported IES file against light counted in zones of equal solid angle."""
    data = RunDirectory.open(subject.run).read_arrays("escaped.npz")
    table = photometry.intensity(data["direction"], data["weight"], subject.description.flux)
    true = IntensityZones.of(trace_records(subject.lamp, paths, 78))
    told = interpolate(table.vertical, table.horizontal, table.values, true.directions()).mean(2)
    return {
        "mean_absolute_over_mean": float(
            np.abs(told - true.intensity).mean() / true.intensity.mean()
        ),
        "truth_noise": float(true.error.mean() / true.intensity.mean()),
    }


def fast_map(subject: Subject, points: int = 256, samples: int = 8) -> Figures:
    """The fast map against the radiance it stands for, at random shading points.

    Returns:
        bias and mean absolute error of the irradiance of planes that face the lamp, times squared
        distance, over its mean; and of the cells over theirs at each point, in the median.
    """
    rng = np.random.default_rng(6)
    point = shading_points(subject.description, points, rng)
    told = subject.luminaire.radiance_map(point).reshape(points, -1, 3).astype(np.float64)
    true, cosine = np.zeros_like(told), np.zeros(told.shape[:2])
    for _ in range(samples):
        seen, facing = _cells(subject, point, rng)
        true, cosine = true + seen / samples, cosine + facing / samples
    cap = measures.cap(point.astype(np.float64), subject.description.sphere)
    away = point.astype(np.float64) - np.asarray(subject.description.sphere.center)
    scale = cosine * (cap.solid_angle * (away**2).sum(1))[:, None]
    light = [(x * scale[..., None]).mean(1) for x in (told, true)]
    cells = np.abs(told - true).mean((1, 2)) / np.maximum(true.mean((1, 2)), 1e-30)
    return {
        "irradiance_bias": float(light[0].mean() / light[1].mean() - 1),
        "irradiance_error": float(np.abs(light[0] - light[1]).mean() / light[1].mean()),
        "cell_error": float(np.median(cells)),
    }


def _cells(
    subject: Subject, point: NDArray[np.float32], rng: np.random.Generator
) -> tuple[Image, Image]:
    """Radiance [P, 256, 3] along a random direction in each cell, and its cosine [P, 256]."""
    sphere, side = subject.description.sphere, 16
    corner = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(1, -1, 2)
    square = (corner + rng.random((len(point), side * side, 2))) / side
    here = np.repeat(point, side * side, 0)
    cap = measures.cap(here.astype(np.float64), sphere)
    toward = measures.cap_to_direction(square.reshape(-1, 2), cap).astype(np.float32)
    seen = look(subject.surface, subject.radiance, here, toward)
    outward = here - np.asarray(sphere.center)
    cosine = -np.einsum("nd,nd->n", toward, outward) / np.linalg.norm(outward, axis=1)
    return seen.reshape(len(point), -1, 3), cosine.reshape(len(point), -1)


def sampler(subject: Subject, points: int = 20) -> Figures:
    """Integral of the pdf over the cap, chi-square, and variance against the uniform cap.

    Effective sample size is (sum w)² / (n sum w²) of the weights L cos / p of irradiance: 1 for a
    sampler that draws in proportion to them. `..._of_light` is its mean over the points in
    proportion to the light they get, times the squared distance: one from where a shade hides all
    but the networks' own haze says little.
    """
    rng = np.random.default_rng(5)
    point = shading_points(subject.description, points, rng)
    results = [_sampler_at(subject, p, rng) for p in point]
    columns = (np.array(column) for column in zip(*results, strict=True))
    integral, p_value, ratio, size, light = columns
    return {
        "integral_error": float(np.abs(integral - 1).max()),
        "chi_square_least_p": float(p_value.min()),
        "chi_square_threshold": 1 - (1 - 0.01) ** (1 / points),
        "variance_factor_mean": float(np.exp(np.log(ratio).mean())),
        "variance_factor_least": float(ratio.min()),
        "effective_sample_size": float(size.mean()),
        "effective_sample_size_of_light": float(np.average(size, weights=light)),
        "effective_sample_size_least": float(size.min()),
    }


def _sampler_at(
    subject: Subject, point: NDArray[np.float32], rng: np.random.Generator, side: int = 256
) -> tuple[float, float, float, float, float]:
    """Integral, chi-square p-value, variance ratio, effective size and light at a shading point."""
    luminaire, sphere = subject.luminaire, subject.description.sphere
    # Integral by midpoint quadrature over the cap's square
    axis = (np.arange(side) + 0.5) / side
    square = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    cap = measures.cap(np.repeat(point[None].astype(np.float64), len(square), 0), sphere)
    toward = measures.cap_to_direction(square, cap).astype(np.float32)
    here = np.repeat(point[None], len(square), 0)
    density = luminaire.pdf_solid_angle(here, toward) * cap.solid_angle
    # Chi-square over 16x16 cells
    u = rng.random((len(square), 2)).astype(np.float32)
    drawn, pdf = luminaire.sample(here, u)
    cell, inside = measures.direction_to_cap(drawn.astype(np.float64), cap)
    index = np.minimum((cell * 16).astype(int), 15)
    observed = np.bincount(index[:, 1] * 16 + index[:, 0], minlength=256)
    expected = density.reshape(16, side // 16, 16, side // 16).mean((1, 3)).reshape(-1)
    expected *= inside.sum() / expected.sum()
    statistic = float(((observed - expected) ** 2 / expected).sum())
    # Variance of the irradiance estimators L cos / p, on a plane that faces the lamp
    cosine = np.einsum("nd,nd->n", drawn, -_axis(point, sphere))
    learned = look(subject.surface, subject.radiance, here, drawn) @ LUMINANCE * cosine / pdf
    plain_cosine = np.einsum("nd,nd->n", toward, -_axis(point, sphere))
    plain = look(subject.surface, subject.radiance, here, toward) @ LUMINANCE
    plain = plain * plain_cosine * cap.solid_angle
    size = float(learned.mean() ** 2 / np.mean(learned**2))
    ratio = float(plain.var() / learned.var())
    square_distance = ((point.astype(np.float64) - np.asarray(sphere.center)) ** 2).sum()
    light = float(learned.mean() * square_distance)
    return float(density.mean()), float(chi2.sf(statistic, 255)), ratio, size, light


def _axis(point: NDArray[np.float32], sphere: measures.BoundingSphere) -> NDArray[np.float64]:
    """Unit normal of a receiver at `point` that faces away from the lamp's centre: [1, 3]."""
    offset = point.astype(np.float64) - np.asarray(sphere.center)
    return (offset / np.linalg.norm(offset))[None]


def hosts(subject: Subject, count: int = 1 << 14) -> Figures:
    """Largest difference of the Mitsuba and the ONNX runtimes on the same queries."""
    from purelight_mitsuba.lamps.luminaire import load

    rng = np.random.default_rng(9)
    fused = load(subject.bundle)
    scale = subject.luminaire.manifest.radiance_scale
    position, normal = subject.surface.sample(count, rng)
    from purelight_train.light.exit_surface import cosine_directions

    outgoing = cosine_directions(normal, rng)
    point = shading_points(subject.description, count, rng)
    u = rng.random((count, 2)).astype(np.float32)
    toward, _ = subject.luminaire.sample(point, u)

    def log(value: NDArray[Any]) -> NDArray[Any]:
        return np.log1p(value / scale)

    surface = [mi.Vector3f(a.T) for a in (position, normal, outgoing)]
    at, aim = mi.Point3f(point.T), mi.Vector3f(toward.T.astype(np.float32))
    pairs: dict[str, tuple[Any, Any]] = {
        "appearance": (
            log(_array(fused.network("appearance")(*surface)[0])),
            log(subject.luminaire.radiance(position, normal, outgoing)),
        ),
        "transparency": (
            _array(fused.network("transparency")(*surface)[0]),
            subject.luminaire.transmittance(position, normal, outgoing),
        ),
        "sampler_pdf": (
            np.log(_array(fused.network("sampler_pdf")(at, aim)[0])[:, 0]),
            np.log(subject.luminaire.pdf_solid_angle(point, toward)),
        ),
        "sampler": (
            _array(fused.network("sampler")(at, mi.Point2f(u.T))[0]),
            toward,
        ),
        "fast_map": (
            log(_array(fused.network("fast_map")(at)[0])),
            log(subject.luminaire.radiance_map(point).reshape(count, -1)),
        ),
    }
    return {k: float(np.abs(a - b).max()) for k, (a, b) in pairs.items()}


def _array(columns: Any) -> NDArray[np.float32]:
    """Dr.Jit columns of a network's output as NumPy: [N, D]."""
    flat = np.asarray(columns, dtype=object).reshape(-1)
    dr.eval(list(flat))  # in one kernel, not in one for each of a map's 768 columns
    return np.stack([np.array(c).reshape(-1) for c in flat], 1)
