"""Noise taken out of pictures by Open Image Denoise, on any processor."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import ModuleType

import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError

INSTALL = 'pip install "purelight[denoise]"'


def require(variant: str) -> None:
    """Finds out whether there is a denoiser, before anything is rendered.

    Raises:
        PureLightError: If there is none for the variant.
    """
    if _library() is None and not variant.startswith("cuda"):
        raise PureLightError(f"--denoise needs Open Image Denoise; {INSTALL}")


def against_filter(film: mi.Film) -> str:
    """One line on a film whose filter spreads noise over pixels; empty if it does not.

    The denoiser tells noise from detail by its differing from pixel to pixel.
    """
    if film.rfilter().is_box_filter():
        return ""
    return (
        "--denoise: the film's filter spreads each sample over its neighbours, so that noise is "
        'kept as blotches; give the film <rfilter type="box"/>'
    )


def denoise(image: np.ndarray, seen: Mapping[str, np.ndarray]) -> np.ndarray:
    """A picture without its noise.

    By Open Image Denoise, or where that is not installed, on CUDA, by OptiX.

    Arguments:
        image: [H, W, 3], linear.
        seen: `albedo` and `normal`, [H, W, 3] each, of what the picture shows first.
    """
    library = _library()
    color = np.nan_to_num(image, nan=0.0, posinf=0.0, neginf=0.0).clip(0).astype(np.float32)
    albedo = np.ascontiguousarray(seen["albedo"].clip(0, 1), np.float32)
    normal = np.ascontiguousarray(seen["normal"].clip(-1, 1), np.float32)
    if library is None:
        height, width = color.shape[:2]
        optix = mi.OptixDenoiser([width, height], albedo=True, normals=True)
        arrays = (mi.TensorXf(np.ascontiguousarray(a)) for a in (color, albedo, normal))
        picture, *rest = arrays
        return np.array(optix(picture, albedo=rest[0], normals=rest[1]))
    result: np.ndarray = library.denoise(color, albedo, normal, hdr=True)
    return result


def denoised(
    image: np.ndarray, groups: Mapping[str, np.ndarray], seen: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A picture and its light groups without noise; where there are groups they still add up to it.

    Arguments:
        image: [H, W, 3].
        groups: Of the same size, by name; they add up to the picture.
        seen: As for `denoise`.
    """
    if not groups:
        return denoise(image, seen), {}
    clean = {name: denoise(group, seen) for name, group in groups.items()}
    whole = np.asarray(np.sum(list(clean.values()), axis=0), np.float32)
    return whole, clean


def _library() -> ModuleType | None:
    """The library; it would load PyTorch where that is installed, and has no use for it here."""
    absent = "torch" not in sys.modules
    if absent:
        sys.modules["torch"] = None  # type: ignore[assignment]  # The import then fails
    try:
        import pyoidn
    except (ImportError, OSError):
        return None
    finally:
        if absent:
            del sys.modules["torch"]
    return pyoidn
