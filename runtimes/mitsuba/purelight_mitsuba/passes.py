"""Renders a scene in passes of bounded memory, with progress."""

from __future__ import annotations

import re
from pathlib import Path

import mitsuba as mi
import numpy as np
from tqdm import tqdm

from purelight_format.errors import PureLightError
from purelight_mitsuba.integrator import PureLightIntegrator

SAMPLES = 1 << 22  # Of one pass; about a gigabyte at most.
OURS = re.compile(r"PureLightError: (.*)")


def load_scene(path: Path) -> mi.Scene:
    """Loads a scene from Mitsuba's XML.

    Raises:
        PureLightError: With one line, if Mitsuba or a lamp refuses it.
    """
    try:
        scene = mi.load_file(str(path))
    except RuntimeError as error:
        raise PureLightError(f"{path}: {reason(str(error))}") from error
    if not isinstance(scene, mi.Scene):
        raise PureLightError(f"{path}: not a scene; its outermost element must be <scene>")
    if not scene.sensors():
        raise PureLightError(f"{path}: the scene has no sensor")
    return scene


def reason(text: str) -> str:
    """The line of a Mitsuba error that says what is wrong."""
    ours = OURS.findall(text)
    if ours:
        return ours[-1]
    lines = [re.sub(r"^\[[^\]]*\]\s*", "", line).strip() for line in text.splitlines()]
    return " ".join(line for line in lines if line)[:300]


def integrator_for(
    scene: mi.Scene, mode: str | None = None, engine: str | None = None
) -> PureLightIntegrator:
    """The scene's integrator if it is PureLight's, else one with default settings."""
    integrator = scene.integrator()
    if not isinstance(integrator, PureLightIntegrator):
        integrator = mi.load_dict({"type": "purelight"})
    if mode is not None:
        integrator.mode = mode
    if engine is not None:
        integrator.engine = engine
    integrator.prepare(scene)
    return integrator


def render_passes(
    scene: mi.Scene,
    integrator: PureLightIntegrator,
    spp: int,
    seed: int = 0,
    *,
    progress: bool = False,
) -> np.ndarray:
    """Renders the scene's first sensor.

    Arguments:
        spp: Samples per pixel in all.
        seed: Equal seeds give equal pictures.
        progress: Whether to show a bar with the time left.

    Returns:
        [H, W, 3] float32, linear.
    """
    pixels = int(np.prod(scene.sensors()[0].film().crop_size()))
    count = max(1, -(-spp * pixels // SAMPLES))
    counts = [len(part) for part in np.array_split(np.arange(spp), min(count, spp))]
    seeds = np.random.SeedSequence(seed).generate_state(len(counts))
    total: np.ndarray | None = None
    with tqdm(total=spp, unit="spp", disable=not progress) as bar:
        for samples, own in zip(counts, seeds, strict=True):
            image = mi.render(scene, integrator=integrator, spp=samples, seed=int(own))
            part = np.array(image)[..., :3].astype(np.float64) * samples
            total = part if total is None else total + part
            bar.update(samples)
    assert total is not None
    return (total / spp).astype(np.float32)


def resize(scene: mi.Scene, width: int) -> None:
    """Gives the first sensor's whole film another width in pixels, at the same aspect ratio."""
    sensor = scene.sensors()[0]
    parameters = mi.traverse(sensor)
    size = np.array(sensor.film().size(), np.float64)
    new = [width, max(round(width * size[1] / size[0]), 1)]
    parameters["film.size"] = new
    parameters["film.crop_size"] = new
    parameters["film.crop_offset"] = [0, 0]
    parameters.update()


def denoise(image: np.ndarray) -> np.ndarray:
    """Mitsuba's OptiX denoiser, for pictures [H, W, 3]; CUDA only."""
    height, width = image.shape[:2]
    return np.array(mi.OptixDenoiser([width, height])(mi.TensorXf(image)))
