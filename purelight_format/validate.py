"""Validation of a bundle: bytes in, report out, cheap stages first."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from purelight_format import container, manifest, members, reference, surface, usd_layer, vectors
from purelight_format.container import Entry
from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError, Issue, fail, issue
from purelight_format.limits import LIMITS
from purelight_format.manifest import Manifest, NetworkInfo
from purelight_format.members import EXTENSIONS, MANIFEST, PHOTOMETRY, PREVIEW
from purelight_format.onnx_profile import inspect
from purelight_format.report import Report
from purelight_format.surface import Surface
from purelight_format.vectors import SIGNATURES, Vectors

PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"
LOOSE = 0.2  # A tolerance above this part of its value would let a wrong host pass.


@dataclass
class Examination:
    """A file under examination: what the stages so far have found.

    Arguments:
        data: the whole file.
        entries: its members, once the container is known to be sound.
        issues: findings of all stages.
    """

    data: bytes
    entries: dict[str, Entry] = field(default_factory=dict)
    issues: list[Issue] = field(default_factory=list)
    _manifest: Manifest | None = None

    @property
    def report(self) -> Report:
        return Report.of(self.issues)

    @property
    def manifest(self) -> Manifest:
        """The manifest, which is known once its stage has passed."""
        assert self._manifest is not None
        return self._manifest

    @property
    def networks(self) -> dict[str, NetworkInfo]:
        """The networks that this version knows."""
        return {name: i for name, i in self.manifest.networks.items() if name in SIGNATURES}

    def read(self, member: str) -> bytes:
        """Bytes of a member.

        Raises:
            FormatError: PLX_MANIFEST_MEMBER_MISSING.
        """
        if member not in self.entries:
            fail("PLX_MANIFEST_MEMBER_MISSING", MANIFEST, member=member)
        return bytes(container.member(self.data, self.entries[member]))

    def find(self, stage: Stage) -> None:
        """Runs a stage; a fault it cannot go on from is its last issue."""
        try:
            self.issues.extend(stage(self))
        except FormatError as error:
            self.issues.append(error.issue)


Stage = Callable[[Examination], Iterator[Issue]]


def validate(source: str | Path | bytes) -> Report:
    """Checks a bundle completely.

    No byte string makes it raise, run code, open another file, or take more memory than a small
    multiple of the file and the golden vectors' evaluation.

    Arguments:
        source: the bytes of a bundle, or the path of one.

    Raises:
        PureLightError: If the path cannot be read, or the onnx package is not installed.
    """
    data = source if isinstance(source, bytes) else read_file(Path(source))
    return examine(data).report


def read_file(path: Path) -> bytes:
    """Reads at most one byte more than a bundle may have.

    Raises:
        PureLightError: If the file cannot be read.
    """
    try:
        with open(path, "rb") as file:
            return file.read(LIMITS.file_bytes + 1)
    except OSError as error:
        raise PureLightError(f"{path}: cannot read: {error.strerror}") from error


def examine(data: bytes, depth: int = 3) -> Examination:
    """Runs the stages and stops after the first one that finds an error.

    Arguments:
        data: the whole file.
        depth: 1 for container, manifest and digests; 2 also for the content of every member;
            3 also for the values that the networks give on their golden vectors.
    """
    stages: tuple[tuple[Stage, ...], ...] = (
        (_container, _manifest, _digests),
        (_members, _networks, _surface, _layer, _vectors),
        (_values,),
    )
    examination = Examination(data)
    for stage in (stage for group in stages[:depth] for stage in group):
        examination.find(stage)
        if any(found.is_error for found in examination.issues):
            break
    return examination


# Container, manifest and digests


def _container(examination: Examination) -> Iterator[Issue]:
    examination.entries = container.scan(examination.data)
    yield from ()


def _manifest(examination: Examination) -> Iterator[Issue]:
    if MANIFEST not in examination.entries:
        fail("PLX_MANIFEST_MISSING", "file")
    examination._manifest, issues = manifest.examine(examination.read(MANIFEST))
    yield from issues


def _digests(examination: Examination) -> Iterator[Issue]:
    """The manifest lists every member but itself, with size and digest."""
    listed, entries = examination.manifest.members, examination.entries
    for name in sorted(listed.keys() - entries.keys()):
        yield issue("PLX_MANIFEST_MEMBER_MISSING", f"{MANIFEST}/members", member=name)
    for name in entries:
        if name == MANIFEST:
            continue
        if name not in listed:
            yield issue("PLX_MANIFEST_MEMBER_UNLISTED", name)
        elif entries[name].size != listed[name].size:
            yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, what="size")
        elif (
            hashlib.sha256(container.member(examination.data, entries[name])).hexdigest()
            != listed[name].sha256
        ):
            yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, what="SHA-256")


# Content of the members


def _members(examination: Examination) -> Iterator[Issue]:
    """Which members there are, and the small ones for people."""
    first = next(iter(examination.entries))
    layers = [n for n in examination.entries if n.lower().endswith(usd_layer.ENDINGS)]
    if layers != [first] or not first.endswith(".usda"):
        yield issue("PLX_USD_NOT_FIRST", first)
    known = {*layers, MANIFEST, PHOTOMETRY, PREVIEW}
    known.update(member for member, _ in surface.MEMBERS.values())
    for network in examination.networks:
        known.update((members.network(network), *vectors.layout(network)))
    for name in examination.entries:
        if name not in known and not name.startswith(EXTENSIONS):
            yield issue("PLX_MEMBER_UNKNOWN", name)
    for name, start in ((PREVIEW, PNG), (PHOTOMETRY, b"IES")):
        if name in examination.entries:
            yield from _small(examination, name, start)


def _small(examination: Examination, name: str, start: bytes) -> Iterator[Issue]:
    size = examination.entries[name].size
    if size > LIMITS.picture_bytes:
        yield issue("PLX_MEMBER_TOO_LARGE", name, size=size, limit=LIMITS.picture_bytes)
    elif not examination.read(name).startswith(start):
        code = "PLX_PREVIEW_INVALID" if name == PREVIEW else "PLX_PHOTOMETRY_INVALID"
        yield issue(code, name)


def _networks(examination: Examination) -> Iterator[Issue]:
    where = f"{MANIFEST}/networks"
    for name in sorted(examination.manifest.networks.keys() - SIGNATURES.keys()):
        yield issue("PLX_MANIFEST_NETWORK_UNKNOWN", f"{where}/{name}")
    needed = {"appearance"} | ({"sampler_pdf"} if "sampler" in examination.networks else set())
    for name in sorted(needed - examination.networks.keys()):
        yield issue("PLX_MANIFEST_NETWORK_MISSING", where, network=name)
    for name, info in examination.networks.items():
        try:
            yield from _network(examination, name, info)
        except FormatError as error:
            yield error.issue


def _network(examination: Examination, name: str, info: NetworkInfo) -> Iterator[Issue]:
    where, member = f"{MANIFEST}/networks/{name}", members.network(name)
    if info.member != member:
        fail("PLX_MANIFEST_SCHEMA", where, expected=f"member must be {member}")
    cost = inspect(examination.read(member), name, member)
    yield from cost.warnings
    for figure in ("macs_per_sample", "floats_per_sample", "bytes"):
        stated, actual = getattr(info, figure), getattr(cost, figure)
        if stated != actual:
            pair = {"stated": stated, "actual": actual}
            yield issue("PLX_MANIFEST_COST_MISMATCH", f"{where}/{figure}", **pair)


def _surface(examination: Examination) -> Iterator[Issue]:
    found = Surface.from_members(examination.read)
    yield from found.issues(examination.manifest.bounding_sphere, examination.manifest.flux)


def _layer(examination: Examination) -> Iterator[Issue]:
    name = next(iter(examination.entries))
    yield from usd_layer.check(examination.read(name), name, examination.entries)


# Golden vectors


def _vectors(examination: Examination) -> Iterator[Issue]:
    for network in examination.networks:
        if not any(member in examination.entries for member in vectors.layout(network)):
            yield issue("PLX_GOLDEN_MISSING", "vectors", network=network)
            continue
        found = Vectors.from_members(network, examination.read)
        for name, tolerance in found.tolerances.items():
            ratio = _looseness(found.outputs[name], tolerance, examination.manifest)
            if ratio > LOOSE:
                where = f"vectors/{network}.{name}"
                yield issue("PLX_GOLDEN_TOLERANCE_LOOSE", where, ratio=ratio)


def _looseness(output: np.ndarray, tolerance: np.ndarray, manifest: Manifest) -> float:
    """The largest tolerance of a vector relative to its largest value, or to the scale."""
    size, width = (np.abs(a).reshape(len(a), -1).max(1) for a in (output, tolerance))
    floor = manifest.radiance_scale if output.ndim > 1 and output.shape[-1] == 3 else 0.0
    return float((width / np.maximum(size + floor, np.finfo(float).tiny)).max())


def _values(examination: Examination) -> Iterator[Issue]:
    """The networks must give what their golden vectors say, here evaluated in float32."""
    for network in examination.networks:
        golden = Vectors.from_members(network, examination.read)
        model = examination.read(members.network(network))
        try:
            results = reference.evaluate(model, golden.inputs, np.float32)
        except FormatError:
            raise
        except PureLightError as error:
            fail("PLX_GOLDEN_BROKEN", members.network(network), what=error)
        compared = vectors.compare(golden, results, examination.manifest.radiance_scale)
        missed = int((~compared.passed).sum())
        if missed:
            worst = max(compared.error.values())
            figures = {"count": missed, "total": len(golden), "error": worst}
            yield issue("PLX_GOLDEN_MISMATCH", f"vectors/{network}", **figures)
