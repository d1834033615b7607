"""Renders a scene in passes of bounded memory, with progress."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from tqdm import tqdm

from purelight_format.errors import PureLightError
from purelight_mitsuba.platform import reading
from purelight_mitsuba.scene_file import reason
from purelight_mitsuba.transport.integrator import PureLightIntegrator

SAMPLES = 1 << 22  # Of one pass; about a gigabyte at most.


def load_scene(path: Path) -> mi.Scene:
    """Loads a scene from Mitsuba's XML.

    Raises:
        PureLightError: With one line, if Mitsuba or a lamp refuses it.
    """
    try:
        with reading():
            scene = mi.load_file(str(path))
    except RuntimeError as error:
        raise PureLightError(f"{path}: {reason(str(error))}") from error
    if not isinstance(scene, mi.Scene):
        raise PureLightError(f"{path}: not a scene; its outermost element must be <scene>")
    if not scene.sensors():
        raise PureLightError(f"{path}: the scene has no sensor")
    return scene


def integrator_for(
    scene: mi.Scene,
    mode: str | None = None,
    engine: str | None = None,
    *,
    light_groups: bool | None = None,
) -> PureLightIntegrator:
    """The scene's integrator if that or what it holds is PureLight's, else one with its depth."""
    integrator = _own(scene.integrator()) or _like(scene.integrator())
    if mode is not None:
        integrator.mode = mode
    if engine is not None:
        integrator.engine = engine
    if light_groups is not None:
        integrator.light_groups = light_groups
    integrator.prepare(scene)
    return integrator


def replaced(scene: mi.Scene) -> str:
    """What of a scene's integrator is not done by `integrator_for`; empty if nothing is lost."""
    if scene.integrator() is None:
        return ""
    name = str(scene.integrator()).partition("[")[0].strip()
    if name in ("PureLightIntegrator", "PathIntegrator"):
        return ""
    if _own(scene.integrator()):
        return f"of the scene's {name} only purelight renders; --aovs adds albedo, normal and depth"
    return f"rendered by purelight in place of the scene's {name}"


class _Held(mi.TraversalCallback):
    """The integrators that another one holds."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[PureLightIntegrator] = []

    def put(self, name: str, value: Any, flags: Any = None) -> None:
        if isinstance(value, mi.Integrator) and (own := _own(value)):
            self.found.append(own)


def _own(integrator: mi.Integrator | None) -> PureLightIntegrator | None:
    """The integrator, or the first that it holds, if that is PureLight's."""
    if integrator is None or isinstance(integrator, PureLightIntegrator):
        return integrator
    held = _Held()
    integrator.traverse(held)
    return held.found[0] if held.found else None


def _like(integrator: mi.Integrator | None) -> PureLightIntegrator:
    """PureLight's integrator with the depth, the roulette and what is hidden of another one."""
    settings: dict[str, Any] = {"hide_emitters": bool(getattr(integrator, "hide_emitters", False))}
    for name in ("max_depth", "rr_depth"):
        if found := re.search(rf"^  {name} = (\d+)", str(integrator), re.MULTILINE):
            settings[name] = int(found[1]) if int(found[1]) < 0x7FFFFFFF else -1
    return mi.load_dict({"type": "purelight", **settings})


def render_passes(
    scene: mi.Scene,
    integrator: PureLightIntegrator,
    spp: int,
    seed: int = 0,
    *,
    progress: bool = False,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Renders the scene's first sensor.

    Arguments:
        spp: Samples per pixel in all.
        seed: Equal seeds give equal pictures.
        progress: Whether to show a bar with the time left.

    Returns:
        The picture, [H, W, 3] float32, linear, or [H, W, 4] if the film keeps alpha; and its light
        groups by name, if the integrator keeps them apart.

    Raises:
        PureLightError: If the film keeps something else than red, green and blue.
    """
    film = re.search(r"pixel_format = (\w+)", str(scene.sensors()[0].film()))
    if film and film[1] not in ("rgb", "rgba"):
        raise PureLightError(f"the film's pixel_format is {film[1]}; give it rgb or rgba")
    pixels = int(np.prod(scene.sensors()[0].film().crop_size()))
    count = max(1, -(-spp * pixels // SAMPLES))
    counts = [len(part) for part in np.array_split(np.arange(spp), min(count, spp))]
    seeds = np.random.SeedSequence(seed).generate_state(len(counts))
    names = [name[: -len(".R")] for name in integrator.aov_names()[::3]]
    total = np.zeros(())
    with tqdm(total=spp, unit="spp", disable=not progress) as bar:
        for samples, own in zip(counts, seeds, strict=True):
            image = mi.render(scene, integrator=integrator, spp=samples, seed=int(own))
            total = total + np.array(image).astype(np.float64) * samples
            bar.update(samples)
    mean = (total / spp).astype(np.float32)
    first = mean.shape[-1] - 3 * len(names)  # The film may add alpha to the picture
    groups = {name: mean[..., first + 3 * k :][..., :3] for k, name in enumerate(names)}
    return mean[..., :first], groups


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
