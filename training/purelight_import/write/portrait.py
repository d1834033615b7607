"""A picture of a lamp: in even light, and lit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere
from purelight_format.srgb import exposure, png
from purelight_mitsuba.platform import reading

SIZE, DAYLIGHT, LIT = 384, 16, 64
DEPTH = 16
AZIMUTH, ASIDE = 35.0, 70.0  # degrees: of the camera, and of the main light from there
DIM, KEY = 0.35, 1.6
DUSK = 0.05  # even light in the second picture, to see the lamp by
BRIGHTER = 2.0  # stops than what shows the emitter itself
CLIP = 40.0  # times white, above which a sample counts as noise


def portrait(path: Path, lumens: float, places: np.ndarray) -> bytes:
    """A PNG of two pictures side by side: the lamp in even light, unlit, and lit in the dark.

    Path tracing finds light through clear glass by chance only, so the second may be noisy.

    Arguments:
        path: a scene of the lamp alone.
        lumens: what its emitters give; zero leaves the second picture out.
        places: [N, 3] of all its corners, in metres.
    """
    import mitsuba as mi

    with reading():
        scene = mi.load_file(str(path), optimize=False)
    centre = 0.5 * (places.min(0) + places.max(0))
    radius = max(float(np.linalg.norm(places - centre, axis=1).max()), 1e-6)
    place = (float(centre[0]), float(centre[1]), float(centre[2]))
    camera = Camera.orbit(BoundingSphere(place, radius), azimuth=AZIMUTH, elevation=12)
    unlit = _unlit(mi, path, camera)
    views = [png(unlit, 0.0)]
    if lumens > 0:
        lit = _render(mi, scene, camera, LIT)
        gain = 2.0 ** (exposure(lit) + BRIGHTER)
        views.append(png(np.minimum(gain * lit, CLIP) + DUSK * unlit, 0.0))
    return _beside(views)


def _unlit(mi: Any, path: Path, camera: Camera) -> np.ndarray:
    """In light from all around, brighter from above, with the emitters dark but grey."""
    with reading():
        parts = mi.load_file(str(path), optimize=False)
    parameters = mi.traverse(parts)
    for key in parameters.keys():  # noqa: SIM118 - it is no dictionary
        if key.endswith("radiance.value"):
            parameters[key] = type(parameters[key])(0.3)
        elif key.endswith("radiance.data"):
            parameters[key] = parameters[key] * 0 + 0.3
    parameters.update()
    turn = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    sky = {"type": "envmap", "bitmap": mi.Bitmap(_sky()), "to_world": turn}
    scene = {"type": "scene", "sky": sky}
    for index, shape in enumerate(parts.shapes()):
        scene[f"shape_{index}"] = shape
    return _render(mi, mi.load_dict(scene, optimize=False), camera, DAYLIGHT)


def _sky() -> np.ndarray:
    """Light from above and from beside the camera, dimmer behind the lamp: [H, W, 3]."""
    rows = np.linspace(1.3, 0.35, 32)
    azimuth = np.pi / 2 - 2 * np.pi * (np.arange(64) + 0.5) / 64  # of a column, about +Z
    columns = DIM + KEY * np.maximum(np.cos(azimuth - np.radians(AZIMUTH + ASIDE)), 0) ** 2
    return np.repeat(np.outer(rows, columns)[..., None], 3, 2).astype(np.float32)


def _render(mi: Any, scene: Any, camera: Camera, samples: int) -> np.ndarray:
    """A linear picture [H, W, 3]."""
    up = camera.axes[1]
    view = mi.ScalarTransform4f().look_at(
        origin=camera.origin.tolist(), target=camera.target.tolist(), up=up.tolist()
    )
    sensor = mi.load_dict({
        "type": "perspective", "to_world": view,
        "fov": float(np.degrees(2 * np.arctan(camera.half_width))),
        "near_clip": 1e-3 * camera.distance, "far_clip": 10 * camera.distance,
        "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
        "sampler": {"type": "independent"},
    })  # fmt: skip
    # `path` shows what is behind thin glass black
    integrator = mi.load_dict({"type": "volpath", "max_depth": DEPTH, "rr_depth": DEPTH})
    image = np.array(mi.render(scene, sensor=sensor, integrator=integrator, spp=samples, seed=0))
    return np.nan_to_num(image[..., :3], posinf=0, neginf=0)


def _beside(views: list[bytes]) -> bytes:
    import io

    from PIL import Image

    images = [Image.open(io.BytesIO(view)) for view in views]
    whole = Image.new("RGB", (SIZE * len(images), SIZE))
    for index, image in enumerate(images):
        whole.paste(image, (SIZE * index, 0))
    buffer = io.BytesIO()
    whole.save(buffer, "PNG")
    return buffer.getvalue()
