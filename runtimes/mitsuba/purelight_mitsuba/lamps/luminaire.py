"""A bundle in memory, one copy however many lamps are made of it."""

from __future__ import annotations

import threading
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.bundle import Bundle
from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.members import PHOTOMETRY
from purelight_format.members.manifest import Manifest
from purelight_format.members.surface import Surface
from purelight_mitsuba.translate.compile_cost import require_compilable
from purelight_mitsuba.translate.golden import require_golden
from purelight_mitsuba.translate.network import FusedNetwork
from purelight_onnx.luminaire import check
from purelight_onnx.session import Session

Version = tuple[int, int]


class Luminaire:
    """A lamp's networks and exit surface in its own frame.

    Networks are translated when they are first asked for, since a scene rarely needs all.

    Arguments:
        bundle: The open bundle.

    Attributes:
        sphere: The bounding sphere.
        flux: [3] in W per channel.
        power: Luminance-weighted flux in W.
        surface: The exit surface.
        finishes: What it is made of; empty where the bundle does not say.
        check_vectors: Whether networks are compared with their golden vectors before use.
    """

    def __init__(self, bundle: Bundle) -> None:
        if "appearance" not in bundle.manifest.networks:
            raise PureLightError(f"{bundle.path}: this bundle has no appearance network")
        self.path, self.digest = bundle.path, bundle.digest
        self.sphere: BoundingSphere = bundle.manifest.bounding_sphere
        self.flux = np.asarray(bundle.manifest.flux, np.float64)
        self.power = float(LUMINANCE @ self.flux)
        self.surface: Surface = bundle.surface()
        self.finishes = bundle.manifest.finishes
        self.check_vectors = True
        self._bundle = bundle
        self._networks: dict[tuple[str, str], FusedNetwork] = {}
        self._checked: set[tuple[str, str]] = set()
        self._sessions: dict[tuple[str, int], Session] = {}

    @property
    def manifest(self) -> Manifest:
        """What the bundle says of itself."""
        return self._bundle.manifest

    def has(self, network: str) -> bool:
        """Returns whether the bundle carries a network."""
        return network in self._bundle.manifest.networks

    def network(self, name: str) -> FusedNetwork:
        """Returns a network of the bundle, translated for the variant in use.

        Raises:
            PureLightError: If the bundle does not carry it, it would take minutes to
                compile, or it does not meet its golden vectors.
        """
        key = (name, mi.variant())
        if key not in self._networks:
            if not self.has(name):
                raise PureLightError(f"{self.path}: no {name} network; export the lamp with it")
            model, title = self._model(name), f"{self.path}: {name}"
            require_compilable(model, name, title)
            self._networks[key] = FusedNetwork(model, name=title)
        if self.check_vectors and key not in self._checked:
            vectors, scale = self._bundle.vectors(name), self.manifest.radiance_scale
            require_golden(self._networks[key], vectors, self._model(name), scale)
            self._checked.add(key)
        return self._networks[key]

    def _model(self, name: str) -> bytes:
        return self._bundle.read(self.manifest.networks[name].member)

    def cost(self, name: str) -> int:
        """Multiply-adds of a network per sample, as the bundle states; none if it has none."""
        return int(self._bundle.manifest.networks[name].macs_per_sample) if self.has(name) else 0

    def session(self, name: str) -> Session:
        """Returns a network of the bundle in ONNX Runtime, on as many threads as Dr.Jit has."""
        key = (name, dr.thread_count())
        if key not in self._sessions:
            info, title = self._bundle.manifest.networks[name], f"{self.path}: {name}"
            session = Session(
                self._bundle.read(info.member), name=title, threads=max(1, dr.thread_count()),
                floats=info.floats_per_sample,
            )  # fmt: skip
            if self.check_vectors:
                check(session, self._bundle.vectors(name))
            self._sessions[key] = session
        return self._sessions[key]

    def photometry(self) -> bytes:
        """Returns the bundle's IES text.

        Raises:
            PureLightError: If it has none.
        """
        if PHOTOMETRY not in self._bundle.entries:
            raise PureLightError(f"{self.path}: no {PHOTOMETRY}; export the lamp with it")
        return self._bundle.read(PHOTOMETRY)

    def normals(self) -> np.ndarray:
        """Geometric unit normals [T, 3] of the triangles, +Z where one has no area."""
        corners = self.surface.positions.astype(np.float64)[self.surface.triangles]
        a, b, c = np.moveaxis(corners, 1, 0)
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return np.where(length > 0, normal / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])


_lock = threading.Lock()  # Mitsuba loads the objects of a scene in parallel.
_by_file: dict[str, tuple[Version, Luminaire]] = {}


def load(path: Path) -> Luminaire:
    """Returns the luminaire of a bundle; equal files and equal contents share one.

    A file that changed is read again, and what it was before is kept only by who uses it.

    Raises:
        PureLightError: If there is no such file, or it is not a valid bundle.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise PureLightError(f"{path}: cannot read the lamp: {error.strerror}") from error
    name, version = str(path.resolve()), (status.st_mtime_ns, status.st_size)
    with _lock:
        if name not in _by_file or _by_file[name][0] != version:
            bundle = Bundle.open(path)
            same = (old for _, old in _by_file.values() if old.digest == bundle.digest)
            _by_file[name] = version, next(same, None) or Luminaire(bundle)
        return _by_file[name][1]
