"""Validation of a bundle: bytes in, report out, cheap stages first."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field

from purelight_format import container, manifest
from purelight_format.container import Entry
from purelight_format.issues import FormatError, Issue, issue
from purelight_format.manifest import MEMBER as MANIFEST
from purelight_format.manifest import Manifest
from purelight_format.report import Report


@dataclass
class Examination:
    """What is known of a file so far."""

    data: bytes
    entries: dict[str, Entry] = field(default_factory=dict)
    manifest: Manifest | None = None
    issues: list[Issue] = field(default_factory=list)

    @property
    def report(self) -> Report:
        return Report.of(self.issues)

    def read(self, member: str) -> bytes:
        return bytes(container.member(self.data, self.entries[member]))


def examine(data: bytes, *, depth: str = "values") -> Examination:
    """Runs the stages up to a depth and stops after the first one with an error."""
    examination = Examination(data)
    for stage in (_container, _manifest, _digests):
        try:
            examination.issues.extend(stage(examination))
        except FormatError as error:
            examination.issues.append(error.issue)
        if any(found.is_error for found in examination.issues):
            break
    return examination


def _container(examination: Examination) -> Iterator[Issue]:
    examination.entries = container.scan(examination.data)
    return iter(())


def _manifest(examination: Examination) -> Iterator[Issue]:
    if MANIFEST not in examination.entries:
        yield issue("PLX_MANIFEST_MISSING", "file")
        return
    examination.manifest, issues = manifest.examine(examination.read(MANIFEST))
    yield from issues


def _digests(examination: Examination) -> Iterator[Issue]:
    assert examination.manifest is not None
    listed = examination.manifest.members
    for name in listed.keys() - examination.entries.keys():
        yield issue("PLX_MANIFEST_MEMBER_MISSING", f"{MANIFEST}/members", member=name)
    for name in examination.entries:
        if name == MANIFEST:
            continue
        if name not in listed:
            yield issue("PLX_MANIFEST_MEMBER_UNLISTED", name)
        elif examination.entries[name].size != listed[name].size:
            yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, what="size")
        elif hashlib.sha256(examination.read(name)).hexdigest() != listed[name].sha256:
            yield issue("PLX_MANIFEST_DIGEST_MISMATCH", name, what="SHA-256")
