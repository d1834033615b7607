"""A luminaire from a `.plux` bundle: radiance, transmittance and sampling, NumPy in and out."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from threading import Lock

import numpy as np

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.members.manifest import Manifest
from purelight_format.networks.vectors import Vectors, compare
from purelight_onnx.exit_surface import ExitSurface
from purelight_onnx.session import Session

UNIT_TOLERANCE = 1e-3


class Luminaire:
    """The networks of one bundle, each loaded when it is first used.

    All quantities are in the luminaire frame: metres, W/(m² sr) per linear Rec.709 channel.

    Arguments:
        bundle: An open bundle.
        check_vectors: Whether to evaluate the golden vectors of each network when it is loaded.
        threads: How many chunks of rows are evaluated at the same time.
    """

    def __init__(self, bundle: Bundle, *, check_vectors: bool = True, threads: int = 1) -> None:
        self.bundle, self.check_vectors, self.threads = bundle, check_vectors, threads
        self._sessions: dict[str, Session] = {}
        self._lock = Lock()

    @classmethod
    def open(cls, path: str | Path, *, check_vectors: bool = True, threads: int = 1) -> Luminaire:
        """Opens and validates a bundle.

        Raises:
            PureLightError: If the file cannot be read or is no valid bundle.
        """
        return cls(Bundle.open(path), check_vectors=check_vectors, threads=threads)

    @property
    def manifest(self) -> Manifest:
        return self.bundle.manifest

    @cached_property
    def exit_surface(self) -> ExitSurface:
        """What rays can meet of the luminaire."""
        return ExitSurface(self.bundle.surface(), self.manifest.bounding_sphere)

    def has(self, network: str) -> bool:
        """Whether the bundle carries this network."""
        return network in self.manifest.networks

    def radiance(
        self, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
    ) -> np.ndarray:
        """Radiance that leaves the exit surface.

        Arguments:
            position: [N, 3] points on the exit surface in metres.
            normal: [N, 3] geometric unit normals on the side of `outgoing`.
            outgoing: [N, 3] unit directions that leave the surface.

        Returns:
            [N, 3] in W/(m² sr).
        """
        feed = _surface_inputs(position, normal, outgoing)
        return self.network("appearance")(feed)["radiance"]

    def transmittance(
        self, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
    ) -> np.ndarray:
        """Throughput of the line through the whole luminaire that leaves here: [N, 3] in [0, 1]."""
        feed = _surface_inputs(position, normal, outgoing)
        return self.network("transparency")(feed)["transmittance"]

    def sample(self, point: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples directions from shading points toward the luminaire.

        Arguments:
            point: [N, 3] in metres.
            u: [N, 2] uniform in [0, 1).

        Returns:
            toward [N, 3] unit directions, pdf_solid_angle [N] in 1/sr; the pdf is zero for points
            inside the bounding sphere, which this sampler does not serve.
        """
        uniform = _rows("u", u, 2)
        if uniform.size and (uniform.min() < 0 or uniform.max() > 1):
            raise PureLightError("u must lie in [0, 1]")
        result = self.network("sampler")({"point": _rows("point", point, 3), "u": uniform})
        return result["toward"], result["pdf_solid_angle"]

    def pdf_solid_angle(self, point: np.ndarray, toward: np.ndarray) -> np.ndarray:
        """Density of `sample` per solid angle: two of [N, 3] -> [N] in 1/sr."""
        feed = {"point": _rows("point", point, 3), "toward": _directions("toward", toward)}
        return self.network("sampler_pdf")(feed)["pdf_solid_angle"]

    def radiance_map(self, point: np.ndarray) -> np.ndarray:
        """Mean radiance in the 16 x 16 equal-area cells of the cap seen from each point.

        Arguments:
            point: [N, 3] in metres.

        Returns:
            [N, 16, 16, 3] in W/(m² sr), row v then column u of the cap's square.
        """
        return self.network("fast_map")({"point": _rows("point", point, 3)})["radiance_map"]

    def network(self, name: str) -> Session:
        """Returns a network's session, loaded and checked at the first call.

        Raises:
            PureLightError: If the bundle lacks it, or its golden vectors are not met.
        """
        with self._lock:
            if name not in self._sessions:
                self._sessions[name] = self._load(name)
            return self._sessions[name]

    def _load(self, name: str) -> Session:
        if not self.has(name):
            raise PureLightError(
                f"{self.bundle.path}: no {name} network in this bundle; export it with --networks"
            )
        info, title = self.manifest.networks[name], f"{self.bundle.path}: {name}"
        model, floats = self.bundle.read(info.member), info.floats_per_sample
        session = Session(model, name=title, threads=self.threads, floats=floats)
        if self.check_vectors:
            check(session, self.bundle.vectors(name))
        return session


def check(network: Callable[..., dict[str, np.ndarray]], vectors: Vectors) -> None:
    """Compares a network with its golden vectors.

    Raises:
        PureLightError: If an output is farther from a vector than that vector's tolerance.
    """
    comparison = compare(vectors, network(vectors.inputs))
    failed = len(vectors) - int(comparison.passed.sum())
    if failed:
        raise PureLightError(
            f"{vectors.network}: {failed} of {len(vectors)} golden vectors are not met; "
            "this host evaluates the network wrongly"
        )


def _surface_inputs(
    position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
) -> dict[str, np.ndarray]:
    return {
        "position": _rows("position", position, 3),
        "normal": _directions("normal", normal),
        "outgoing": _directions("outgoing", outgoing),
    }


def _rows(name: str, array: np.ndarray, width: int) -> np.ndarray:
    """Returns finite float32 rows [N, width]."""
    try:
        with np.errstate(over="ignore"):
            rows = np.asarray(array).astype(np.float32)
    except (TypeError, ValueError):
        raise PureLightError(f"{name} must be an array of numbers") from None
    if rows.ndim != 2 or rows.shape[1] != width:
        raise PureLightError(f"{name} must have shape [N, {width}], not {list(rows.shape)}")
    if not np.isfinite(rows).all():
        raise PureLightError(f"{name} must be finite")
    return rows


def _directions(name: str, array: np.ndarray) -> np.ndarray:
    """Returns unit vectors [N, 3]."""
    rows = _rows(name, array, 3)
    length = np.linalg.norm(rows.astype(np.float64), axis=1)
    if (np.abs(length - 1) > UNIT_TOLERANCE).any():
        raise PureLightError(f"{name} must have unit length")
    return rows
