"""Compression of bins: Haar wavelets in four dimensions, the largest coefficients kept."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.rivals.wcl.bins import Bins
from purelight_format.errors import PureLightError

AXES = (0, 1, 2, 3)
WAVELET, MODE = "haar", "periodization"
STEPS = 12  # of the search for as many coefficients as fit


@dataclass(frozen=True)
class Compressed:
    """What is stored, and what comes of it.

    Arguments:
        data: bytes.
        kept: coefficients of all.
        bins: decoded.
    """

    data: bytes
    kept: float
    bins: Bins


def compress(bins: Bins, budget: int) -> Compressed:
    """Keep as many coefficients, largest first, as a budget of bytes allows.

    A coefficient is stored as a 16-bit float, with the distance from the one before, and all are
    packed by zlib. Channels have coefficients of their own. The decoded bins keep their flux.

    Raises:
        PureLightError: PyWavelets is not installed.
    """
    flat, slices = _forward(bins)
    order = np.argsort(-np.abs(flat), kind="stable")
    order = order[: int(np.count_nonzero(flat))]
    low, high, best = 0, len(order), b""
    for _ in range(STEPS):
        middle = (low + high + 1) // 2
        data = _pack(flat, order[:middle])
        if len(data) <= budget:
            low, best = middle, data
        else:
            high = middle - 1
        if low >= high:
            break
    decoded = np.zeros(len(flat))
    decoded[order[:low]] = _stored(flat, order[:low])
    bins_again = replace(bins, values=_inverse(decoded, bins, slices)).scaled(bins.flux)
    return Compressed(best, low / len(flat), bins_again)


def _scale(flat: NDArray[np.float64]) -> float:
    return float(np.abs(flat).max()) / 1e4 or 1.0


def _stored(flat: NDArray[np.float64], chosen: NDArray[np.int64]) -> NDArray[np.float64]:
    """Values as 16-bit floats hold them."""
    scale = _scale(flat)
    held: NDArray[np.float64] = (flat[chosen] / scale).astype(np.float16).astype(np.float64)
    return held * scale


def _pack(flat: NDArray[np.float64], chosen: NDArray[np.int64]) -> bytes:
    place = np.sort(chosen)
    gap = np.diff(place, prepend=0)
    small = np.minimum(gap, 255).astype(np.uint8)
    large = gap[gap >= 255].astype(np.uint32)
    value = (flat[place] / _scale(flat)).astype(np.float16)
    return zlib.compress(small.tobytes() + large.tobytes() + value.tobytes(), 6)


def _forward(bins: Bins) -> tuple[NDArray[np.float64], Any]:
    """Coefficients of all faces and channels in a row, and where which are."""
    wavelets, parts, slices = _pywt(), [], None
    for face in bins.values:
        for channel in np.moveaxis(face, -1, 0):
            found = wavelets.wavedecn(channel, WAVELET, MODE, axes=AXES)
            array, slices = wavelets.coeffs_to_array(found)
            parts.append(array.ravel())
    return np.concatenate(parts), slices


def _inverse(flat: NDArray[np.float64], bins: Bins, slices: Any) -> NDArray[np.float64]:
    wavelets, shape = _pywt(), bins.values.shape[1:5]
    result = np.empty_like(bins.values)
    parts = flat.reshape(len(bins.values), 3, *shape)
    for face, channels in enumerate(parts):
        for channel, array in enumerate(channels):
            found = wavelets.array_to_coeffs(array, slices, output_format="wavedecn")
            result[face, ..., channel] = wavelets.waverecn(found, WAVELET, MODE, axes=AXES)
    return result


def _pywt() -> Any:
    try:
        import pywt
    except ImportError:
        raise PureLightError('PyWavelets is missing; pip install "purelight[bench]"') from None
    return pywt
