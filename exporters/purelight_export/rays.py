"""Rays of a lamp: drawn from a bundle, traced anew for a run, or those of a ray file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import flux_estimate
from purelight_format.members.manifest import bright
from purelight_format.ray_file.conversion import file_of, rays_of
from purelight_format.ray_file.files import is_ray_file, read_ray_file
from purelight_format.ray_file.ray_file import LUMENS, WATTS, RayFile
from purelight_format.ray_file.rays import Rays
from purelight_onnx.lighting import chances
from purelight_onnx.luminaire import Luminaire

if TYPE_CHECKING:
    from purelight_train.light.exit_records import ExitRecords
    from purelight_train.light.luminaire import Luminaire as ModelledLuminaire
    from purelight_train.light.measured_luminaire import MeasuredLuminaire

    Light = ModelledLuminaire | MeasuredLuminaire

CHUNK = 1 << 14  # Rays drawn at a time, each from `CANDIDATES`.
CANDIDATES = 8
LIFT = 1e-5  # Of the radius.
FRUITLESS = 16  # Chunks without a ray, after which there is none.
FLUXES = (WATTS, LUMENS, "X", "Z")
Progress = Callable[[int], None]


def rays_file(
    source: Path, count: int | None, seed: int, progress: Progress = lambda _: None
) -> RayFile:
    """The rays of a bundle, a run directory or a ray file.

    Arguments:
        count: how many rays; of a ray file, all by default.
        progress: called with the rays done so far.

    Raises:
        PureLightError: It is none of these, or sends out no light.
    """
    if is_ray_file(source):
        return _some(read_ray_file(source), count, seed)
    count = count or 1_000_000
    if source.is_dir():
        rays, name = _run_rays(source, count, seed, progress)
    else:
        luminaire = Luminaire.open(source)
        rays, name = bundle_rays(luminaire, count, seed, progress), luminaire.manifest.name
    return replace(file_of(rays, name), texts={"made_by": "PureLight"})


def scaled_to(file: RayFile, lumens: float) -> RayFile:
    """The same rays with another luminous flux.

    Raises:
        PureLightError: It has none to scale, or float32 cannot hold what it would have.
    """
    factor = np.ones(len(file.columns), np.float32)
    now = file.totals().get(LUMENS) or rays_of(file).lumens
    if not now > 0:
        raise PureLightError(f"{file.name}: gives no visible light, so it cannot have --lumens")
    if not (bright(lumens) and bright(lumens / max(len(file), 1))):
        raise PureLightError(f"--lumens {lumens:g}: a ray file cannot hold it; give another number")
    factor[[name in FLUXES for name in file.columns]] = lumens / now
    stated = {name: value * lumens / now for name, value in file.stated.items()}
    return replace(file, rows=file.rows * factor, stated=stated)


def bundle_rays(
    luminaire: Luminaire, count: int, seed: int, progress: Progress = lambda _: None
) -> Rays:
    """Rays that leave a bundle for good, of nearly equal luminous flux, [count].

    Each is one of several candidates, by area and cosine, chosen by its light (resampled importance
    sampling, Talbot 2005); all are scaled to the flux that the manifest tells.

    Raises:
        PureLightError: The lamp is dark, or its networks are.
    """
    flux = np.asarray(luminaire.manifest.flux)
    if not flux.max() > 0:
        raise PureLightError(f"{luminaire.manifest.name}: gives no light, so it has no rays")
    rng, parts, found = np.random.default_rng(seed), [], 0
    while found < count:
        part = _drawn(luminaire, min(CHUNK, 2 * (count - found) + 64), rng)
        parts.append(part)
        found += len(part)
        if not found and len(parts) == FRUITLESS:
            raise PureLightError(
                f"{luminaire.manifest.name}: its networks give none of the light that its manifest "
                "tells, so it has no rays; check it with purelight-validate"
            )
        progress(min(found, count))
    columns = [
        np.concatenate([getattr(part, name) for part in parts])[:count]
        for name in ("position", "direction", "power")
    ]
    total = columns[2].sum(0, dtype=np.float64)
    scale = np.divide(flux, total, out=np.zeros(3), where=total > 0)
    return Rays(columns[0], columns[1], (columns[2] * scale).astype(np.float32))


def _drawn(luminaire: Luminaire, count: int, rng: np.random.Generator) -> Rays:
    """One ray of each group of candidates that has light; powers are on a common scale."""
    position, outgoing, power = _candidates(luminaire, count * CANDIDATES, rng)
    light = (power @ LUMINANCE).reshape(count, CANDIDATES)
    reached = np.cumsum(light, 1)
    total = reached[:, -1]
    lit = np.flatnonzero(total > 0)
    chosen = (reached[lit] < rng.random((len(lit), 1)) * total[lit, None]).sum(1)
    chosen = np.minimum(chosen, CANDIDATES - 1)
    place = lit * CANDIDATES + chosen
    hue = power[place] / light[lit, chosen][:, None]
    return Rays(
        position[place].astype(np.float32), outgoing[place].astype(np.float32),
        (hue * total[lit, None] / CANDIDATES).astype(np.float32),
    )  # fmt: skip


def _candidates(
    luminaire: Luminaire, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays by flux or area and by cosine to either side: position, direction, power [N, 3] in W.

    What meets the lamp again carries nothing.
    """
    surface = luminaire.exit_surface
    chance = chances(luminaire).astype(np.float64)
    if not chance.any():
        raise PureLightError(f"{luminaire.manifest.name}: its exit surface has no area, so no rays")
    triangle = rng.choice(len(chance), count, p=chance / chance.sum())
    position = surface.point(triangle, rng.random((count, 2)))
    normal = surface.normal[triangle] * rng.choice([-1.0, 1.0], (count, 1))
    outgoing = normal + _sphere(rng, count)
    outgoing /= np.maximum(np.linalg.norm(outgoing, axis=1, keepdims=True), 1e-9)
    hidden = surface.intersect(position + LIFT * surface.radius * normal, outgoing).ray
    power = np.zeros((count, 3))
    free = np.setdiff1d(np.arange(count), hidden)
    radiance = luminaire.radiance(position[free], normal[free], outgoing[free])
    pdf_area = chance[triangle[free]] / (2 * surface.area[triangle[free]])
    projected = np.full(len(free), 1 / np.pi)
    power[free] = flux_estimate(radiance.astype(np.float64), pdf_area, projected)
    return position, outgoing, power


def _sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    direction = rng.normal(size=(count, 3))
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _run_rays(source: Path, count: int, seed: int, progress: Progress) -> tuple[Rays, str]:
    """Light traced anew out of a run's lamp, or the rays that it was trained on."""
    from purelight_train.runs.pipeline import reopen
    from purelight_train.runs.run_directory import RunDirectory

    run = RunDirectory.open(source)
    scene = Path(run.config["luminaire"])
    if is_ray_file(scene):
        raise PureLightError(f"{source}: was trained from rays, {scene.name}; give that file")
    return traced_rays(reopen(run, scene).lamp.modelled, count, seed, progress), scene.stem


def traced_rays(
    luminaire: Light, count: int, seed: int, progress: Progress = lambda _: None
) -> Rays:
    """Light traced out of a lamp that has a scene: [count] rays, of power as they come."""
    parts: list[ExitRecords] = []
    found = paths = 0
    while found < count:
        records = luminaire.trace(count - found, seed * 9973 + 1_000_003 + len(parts))
        part = records.take(records.escaped)
        parts.append(part)
        found, paths = found + len(part), paths + records.paths
        progress(min(found, count))
    rng = np.random.default_rng(seed)
    order = np.sort(rng.permutation(found)[:count])
    columns = [
        np.concatenate([getattr(part, name) for part in parts])[order]
        for name in ("position", "direction", "weight")
    ]
    power = columns[2] * np.float32(found / count / paths)
    return Rays(columns[0], columns[1], power)


def _some(file: RayFile, count: int | None, seed: int) -> RayFile:
    """All rays of a file, or some that stand for all: with the flux of all of them."""
    if count is None or count >= len(file):
        return file
    chosen = np.sort(np.random.default_rng(seed).choice(len(file), count, replace=False))
    some = replace(file, rows=file.rows[chosen])
    factor = np.ones(len(file.columns), np.float32)
    for index, name in enumerate(file.columns):
        if name in FLUXES:
            all_of_it, drawn = file.total(name), some.total(name)
            factor[index] = all_of_it / drawn if drawn > 0 else len(file) / count
    return replace(some, rows=some.rows * factor)


def summary(file: RayFile, path: Path) -> str:
    """A line about a file that was written."""
    totals = ", ".join(
        f"{total:.5g} {'lm' if name == LUMENS else 'W'}" for name, total in file.totals().items()
    )
    return f"{path}  {path.stat().st_size / 1e6:.2f} MB: {len(file):,} rays, {totals}"
