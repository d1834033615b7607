"""Validation of a bundle: bytes in, report out, cheap stages first."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from purelight_format import members
from purelight_format.errors import PureLightError
from purelight_format.files import read_file
from purelight_format.issues import Findings, FormatError, Issue, fail, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.members import (
    EXTENSIONS,
    MANIFEST,
    PHOTOMETRY,
    PREVIEW,
    container,
    finishes,
    manifest,
    png,
    surface,
)
from purelight_format.members.container import Entry
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.members.surface import Surface
from purelight_format.networks import reference, vectors
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.profile import NetworkCost, inspect
from purelight_format.networks.tiers import TIERS, fault
from purelight_format.networks.vectors import Vectors
from purelight_format.usd import layer, side_layer
from purelight_format.validation.report import Report
from purelight_format.verdict.figures import read as read_verdict

LOOSE = 0.2  # A tolerance above this part of its value would let a wrong host pass.


@dataclass
class Examination:
    """A file under examination: what the stages so far have found.

    Arguments:
        data: the whole file.
        limits: what is accepted.
        entries: its members, once the container is known to be sound.
        costs: of its networks, once they are vetted.
    """

    data: bytes
    limits: Limits = LIMITS
    entries: dict[str, Entry] = field(default_factory=dict)
    costs: dict[str, NetworkCost] = field(default_factory=dict)
    _manifest: Manifest | None = None

    def __post_init__(self) -> None:
        self.findings = Findings(self.limits.issues)

    @property
    def report(self) -> Report:
        return Report.of(self.findings, self.limits)

    @property
    def manifest(self) -> Manifest:
        """The manifest, which is known once its stage has passed."""
        assert self._manifest is not None
        return self._manifest

    @property
    def networks(self) -> dict[str, NetworkInfo]:
        """The networks that this version knows."""
        return {name: i for name, i in self.manifest.networks.items() if name in KINDS}

    def read(self, member: str) -> bytes:
        """Bytes of a member.

        Raises:
            FormatError: PLX_MANIFEST_MEMBER_MISSING.
        """
        if member not in self.entries:
            fail("PLX_MANIFEST_MEMBER_MISSING", MANIFEST, member=member)
        return bytes(container.member(self.data, self.entries[member]))

    def find(self, stage: Stage) -> None:
        """Runs a stage; a fault it cannot go on from, even one of ours, is its last issue.

        Raises:
            PureLightError: If a package is missing that the stage needs.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # `-W error` would change verdicts.
                for found in stage(self):
                    self.findings.add(found)
        except FormatError as error:
            self.findings.add(error.issue)
        except PureLightError:
            raise
        except Exception as error:  # Whatever we did not foresee must not pass.
            what = f"{type(error).__name__}: {error}"
            self.findings.add(issue("PLX_VALIDATOR_FAULT", "file", what=what))


Stage = Callable[[Examination], Iterator[Issue]]


def validate(source: str | Path | bytes, limits: Limits = LIMITS) -> Report:
    """Checks a bundle completely, and the USD layer that lies beside it under its name.

    No byte string makes it raise, run code, open a file besides these two, or take more memory
    than a small multiple of the file and the golden vectors' evaluation.

    Arguments:
        source: the bytes of a bundle, or the path of one.
        limits: what is accepted; lower limits than those of the format refuse more.

    Raises:
        PureLightError: If the path cannot be read.

    >>> report = validate(b"no bundle")
    >>> report.valid, [issue.code.name for issue in report.issues]
    (False, ['PLX_ZIP_BAD_SIGNATURE'])
    """
    if isinstance(source, bytes):
        return examine(source, limits=limits).report
    examination = examine_file(Path(source), limits=limits)
    if not examination.findings.errors:
        digest = hashlib.sha256(examination.read(MANIFEST)).hexdigest()
        examination.find(lambda _: side_layer.check(Path(source), digest, limits))
    return examination.report


def examine_file(path: Path, depth: int = 3, limits: Limits = LIMITS) -> Examination:
    """Reads a file and examines its bytes, see `examine`; one that is too large is not read.

    Raises:
        PureLightError: If the file cannot be read.
    """
    try:
        return examine(read_file(path, limits.file_bytes), depth, limits)
    except FormatError as error:
        examination = Examination(b"", limits)
        examination.findings.add(error.issue)
        return examination


def examine(data: bytes, depth: int = 3, limits: Limits = LIMITS) -> Examination:
    """Runs the stages and stops after the first one that finds an error.

    Arguments:
        data: the whole file.
        depth: 1 for container, manifest, digests and the USD layer; 2 also for the content of
            every other member; 3 also for the values that the networks give on their golden
            vectors.
        limits: what is accepted.
    """
    stages: tuple[tuple[Stage, ...], ...] = (
        (_container, _manifest, _digests, _layer),
        (_members, _networks, _surface, _vectors),
        (_values,),
    )
    examination = Examination(data, limits)
    for stage in (stage for group in stages[:depth] for stage in group):
        examination.find(stage)
        if examination.findings.errors:
            break
    return examination


# Container, manifest and digests


def _container(examination: Examination) -> Iterator[Issue]:
    examination.entries = container.scan(examination.data, examination.limits)
    yield from ()


def _manifest(examination: Examination) -> Iterator[Issue]:
    if MANIFEST not in examination.entries:
        fail("PLX_MANIFEST_MISSING", "file")
    data = examination.read(MANIFEST)
    examination._manifest, issues = manifest.examine(data, examination.limits)
    yield from issues
    about = examination._manifest
    stated = None if about is None else about.fidelity.get("verdict")
    if stated is not None and read_verdict(stated) is None:
        yield issue("PLX_MANIFEST_VERDICT", f"{MANIFEST}/fidelity/verdict")


def _digests(examination: Examination) -> Iterator[Issue]:
    """The manifest lists every member but itself, with size and digest."""
    listed, entries = examination.manifest.members, examination.entries
    if MANIFEST in listed:
        fail("PLX_MANIFEST_SCHEMA", f"{MANIFEST}/members", expected="must not list the manifest")
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


def _layer(examination: Examination) -> Iterator[Issue]:
    first = next(iter(examination.entries))
    layers = [n for n in examination.entries if n.lower().endswith(layer.ENDINGS)]
    if layers != [first] or not first.endswith(".usda") or "/" in first:
        fail("PLX_USD_NOT_FIRST", first)
    data, limits = examination.read(first), examination.limits
    yield from layer.check(data, first, examination.entries, limits)


# Content of the members


def _members(examination: Examination) -> Iterator[Issue]:
    """Which members there are, and the small ones for people."""
    known = {next(iter(examination.entries)), MANIFEST, PHOTOMETRY, PREVIEW}
    known.update(member for member, _ in surface.MEMBERS.values())
    known.update([finishes.MEMBER] if examination.manifest.finishes else [])
    for network in examination.networks:
        known.update((members.network(network), *vectors.layout(network)))
    for name in examination.entries:
        if name not in known and not name.startswith(EXTENSIONS):
            yield issue("PLX_MEMBER_UNKNOWN", name)
    for name in (PREVIEW, PHOTOMETRY):
        if name in examination.entries:
            yield from _small(examination, name)


def _small(examination: Examination, name: str) -> Iterator[Issue]:
    size, limits = examination.entries[name].size, examination.limits
    if size > limits.picture_bytes:
        yield issue("PLX_MEMBER_TOO_LARGE", name, size=size, limit=limits.picture_bytes)
    elif name == PREVIEW:
        yield from png.check(examination.read(name), name, limits)
    elif not examination.read(name).startswith(b"IES"):
        yield issue("PLX_PHOTOMETRY_INVALID", name)


def _networks(examination: Examination) -> Iterator[Issue]:
    where = f"{MANIFEST}/networks"
    for name in sorted(examination.manifest.networks.keys() - KINDS.keys()):
        yield issue("PLX_MANIFEST_NETWORK_UNKNOWN", f"{where}/{name}")
    needed = {name for name, kind in KINDS.items() if kind.required}
    needed |= {other for name in examination.networks for other in KINDS[name].needs}
    for name in sorted(needed - examination.networks.keys()):
        yield issue("PLX_MANIFEST_NETWORK_MISSING", where, network=name)
    for name, info in examination.networks.items():
        try:
            yield from _network(examination, name, info)
        except FormatError as error:
            yield error.issue
    if not examination.findings.errors:
        yield from _tier(examination)


def _tier(examination: Examination) -> Iterator[Issue]:
    """Every network must keep to the tier that is stated; of other tiers nothing is known."""
    stated = examination.manifest.tier
    if stated not in TIERS:
        return
    for name in examination.costs:
        found = fault(TIERS[stated], examination.read(members.network(name)), name)
        if found:
            pair = {"stated": stated, "actual": f"none: {name} has {found}"}
            yield issue("PLX_MANIFEST_COST_MISMATCH", f"{MANIFEST}/tier", **pair)


def _network(examination: Examination, name: str, info: NetworkInfo) -> Iterator[Issue]:
    where, member = f"{MANIFEST}/networks/{name}", members.network(name)
    if info.member != member:
        fail("PLX_MANIFEST_SCHEMA", where, expected=f"member must be {member}")
    cost = inspect(examination.read(member), name, member, examination.limits)
    examination.costs[name] = cost
    yield from cost.warnings
    for figure in ("macs_per_sample", "floats_per_sample", "bytes"):
        stated, actual = getattr(info, figure), getattr(cost, figure)
        if stated != actual:
            pair = {"stated": stated, "actual": actual}
            yield issue("PLX_MANIFEST_COST_MISMATCH", f"{where}/{figure}", **pair)


def _surface(examination: Examination) -> Iterator[Issue]:
    count = len(examination.manifest.finishes)
    found = Surface.from_members(examination.read, examination.limits, count)
    yield from found.issues(
        examination.manifest.bounding_sphere, examination.manifest.flux, examination.limits
    )


# Golden vectors


def _vectors(examination: Examination) -> Iterator[Issue]:
    work = 0.0
    for network in examination.networks:
        if not any(member in examination.entries for member in vectors.layout(network)):
            yield issue("PLX_GOLDEN_MISSING", "vectors", network=network)
            continue
        found = Vectors.from_members(network, examination.read, examination.limits)
        work += len(found) * examination.costs[network].nanoseconds / 1e6
        for name, unit in KINDS[network].units(examination.manifest.radiance_scale).items():
            ratio = _looseness(found.outputs[name], found.tolerances[name], unit)
            yield from vectors.beyond(found, name, examination.manifest.channels)
            if ratio > LOOSE:
                where = f"vectors/{network}.{name}"
                yield issue("PLX_GOLDEN_TOLERANCE_LOOSE", where, ratio=ratio)
    if work > examination.limits.golden_milliseconds:
        limit = examination.limits.golden_milliseconds
        yield issue("PLX_GOLDEN_COST", "vectors", size=round(work), limit=limit)


def _looseness(output: np.ndarray, tolerance: np.ndarray, unit: float) -> float:
    """The largest tolerance of a vector relative to its largest value, and to the unit."""
    size, width = (np.abs(a).reshape(len(a), -1).max(1) for a in (output, tolerance))
    return float((width / np.maximum(size + unit, np.finfo(float).tiny)).max())


def _values(examination: Examination) -> Iterator[Issue]:
    """The networks must give what their golden vectors say, here evaluated in float32."""
    for network in examination.networks:
        golden = Vectors.from_members(network, examination.read, examination.limits)
        model = examination.read(members.network(network))
        try:
            cost = examination.costs[network]
            results = reference.evaluate(model, golden.inputs, np.float32, cost)
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
