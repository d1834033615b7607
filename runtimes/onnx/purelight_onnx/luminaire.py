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
from purelight_format.networks.kinds import KINDS, Input
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
        surface = {"position": position, "normal": normal, "outgoing": outgoing}
        return self.evaluate("appearance", **surface)["radiance"]

    def transmittance(
        self, position: np.ndarray, normal: np.ndarray, outgoing: np.ndarray
    ) -> np.ndarray:
        """Throughput of the line through the whole luminaire that leaves here: [N, 3] in [0, 1]."""
        surface = {"position": position, "normal": normal, "outgoing": outgoing}
        return self.evaluate("transparency", **surface)["transmittance"]

    def sample(self, point: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples directions from shading points toward the luminaire.

        Arguments:
            point: [N, 3] in metres.
            u: [N, 2] uniform in [0, 1).

        Returns:
            toward [N, 3] unit directions, pdf_solid_angle [N] in 1/sr; the pdf is zero for points
            inside the bounding sphere, which this sampler does not serve.
        """
        result = self.evaluate("sampler", point=point, u=u)
        return result["toward"], result["pdf_solid_angle"]

    def pdf_solid_angle(self, point: np.ndarray, toward: np.ndarray) -> np.ndarray:
        """Density of `sample` per solid angle: two of [N, 3] -> [N] in 1/sr."""
        return self.evaluate("sampler_pdf", point=point, toward=toward)["pdf_solid_angle"]

    def radiance_map(self, point: np.ndarray) -> np.ndarray:
        """Mean radiance in the 16 x 16 equal-area cells of the cap seen from each point.

        Arguments:
            point: [N, 3] in metres.

        Returns:
            [N, 16, 16, 3] in W/(m² sr), row v then column u of the cap's square.
        """
        return self.evaluate("fast_map", point=point)["radiance_map"]

    def evaluate(self, network: str, **inputs: np.ndarray) -> dict[str, np.ndarray]:
        """Answers of any network of the bundle.

        Arguments:
            network: a key of `KINDS`.
            inputs: [N, ...] each, by the names of its kind.

        Returns:
            [N, ...] by the names of its kind.

        Raises:
            PureLightError: If the bundle lacks it, or an input is missing or is not what it
                should be.
        """
        session, asked = self.network(network), KINDS[network].inputs
        if inputs.keys() != asked.keys():
            raise PureLightError(f"{network} takes {', '.join(asked)}, not {', '.join(inputs)}")
        return session({name: _checked(name, inputs[name], asked[name]) for name in asked})

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


def _checked(name: str, array: np.ndarray, asked: Input) -> np.ndarray:
    """Returns an input as float32, if it is what a network takes."""
    rows = _rows(name, array, asked.shape)
    if asked.square and rows.size and (rows.min() < 0 or rows.max() > 1):
        raise PureLightError(f"{name} must lie in [0, 1]")
    length = np.linalg.norm(rows.astype(np.float64), axis=1)
    if asked.unit and (np.abs(length - 1) > UNIT_TOLERANCE).any():
        raise PureLightError(f"{name} must have unit length")
    return rows


def _rows(name: str, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Returns finite float32 rows [N, *shape]."""
    try:
        with np.errstate(over="ignore"):
            rows = np.asarray(array).astype(np.float32)
    except (TypeError, ValueError):
        raise PureLightError(f"{name} must be an array of numbers") from None
    if rows.shape[1:] != shape or rows.ndim == 0:
        sizes = ", ".join(map(str, ("N", *shape)))
        raise PureLightError(f"{name} must have shape [{sizes}], not {list(rows.shape)}")
    if not np.isfinite(rows).all():
        raise PureLightError(f"{name} must be finite")
    return rows
