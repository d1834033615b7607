"""A bundle on disk: written whole and checked, or not at all; read from one snapshot of bytes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS, Limits
from purelight_format.members import MANIFEST, PHOTOMETRY, container
from purelight_format.members import PREVIEW as PREVIEW
from purelight_format.members.container import Entry
from purelight_format.members.manifest import Manifest, Member
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import Vectors
from purelight_format.usd import asset_layer
from purelight_format.validation.validate import Examination, examine, examine_file


@dataclass(frozen=True)
class Bundle:
    """An open bundle.

    Arguments:
        path: where it was read from.
        manifest: its content.
        data: the bytes of the whole file.
        entries: its members.
    """

    path: Path
    manifest: Manifest
    data: bytes
    entries: dict[str, Entry]

    @staticmethod
    def open(path: str | Path, *, validate: bool = True, limits: Limits = LIMITS) -> Bundle:
        """Reads a bundle into memory.

        Arguments:
            path: a .plux file, or the same bytes under another name.
            validate: whether to check everything but the values of the networks, which the
                golden vectors check in the host itself; otherwise only the container, the
                manifest, the digests and the USD layer are.
            limits: what is accepted; lower limits than those of the format refuse more.

        Raises:
            PureLightError: If it cannot be read or is not valid.
        """
        path = Path(path)
        checked = examine_file(path, depth=2 if validate else 1, limits=limits)
        manifest = _require_valid(checked, f"{path}: not a valid bundle")
        return Bundle(path, manifest, checked.data, checked.entries)

    @property
    def digest(self) -> str:
        """SHA-256 of manifest.json in hexadecimal, and so of every member it lists."""
        return hashlib.sha256(self.read(MANIFEST)).hexdigest()

    def read(self, member: str) -> bytes:
        """Returns the bytes of a member.

        Raises:
            PureLightError: If there is no such member.
        """
        if member not in self.entries:
            raise PureLightError(f"{self.path}: no member {member} in this bundle")
        return bytes(container.member(self.data, self.entries[member]))

    def surface(self) -> Surface:
        """Returns the exit surface."""
        return Surface.from_members(self.read, finish_count=len(self.manifest.finishes))

    def vectors(self, network: str) -> Vectors:
        """Returns the golden vectors of a network."""
        return Vectors.from_members(network, self.read)


def write(path: str | Path, manifest: Manifest, members: Mapping[str, bytes]) -> Bundle:
    """Writes a bundle; the same content gives the same bytes.

    The list of members in the manifest is filled in, the USD layer is made from the manifest and
    the surface unless it is among the members, and the file takes its name only after it was
    read back and found valid.

    Arguments:
        path: the .plux file to make or replace.
        manifest: its content.
        members: bytes by name, without the manifest.

    Returns:
        The bundle as it was read back.

    Raises:
        PureLightError: If it cannot be written or would not be valid; an older file is untouched.
    """
    path = Path(path)
    ordered = arrange(manifest, members)
    with atomic.replace_file(path) as file:
        container.write(file, ordered)
        file.flush()
        file.seek(0)
        checked = examine(file.read())
        complete = _require_valid(checked, f"{path}: not written, it would not be a valid bundle")
    return Bundle(path, complete, checked.data, checked.entries)


def _require_valid(checked: Examination, failure: str) -> Manifest:
    """Returns the manifest of a valid bundle.

    Raises:
        PureLightError: With the first error.
    """
    errors = checked.report.errors
    if errors:
        first = errors[0]
        more = f" (and {len(errors) - 1} more; see purelight-validate)" if len(errors) > 1 else ""
        raise PureLightError(
            f"{failure}: {first.code.name} at {first.location}: {first.message}{more}"
        )
    return checked.manifest


def arrange(manifest: Manifest, members: Mapping[str, bytes]) -> dict[str, bytes]:
    """All members of a bundle in their order, with the manifest that lists them."""
    layers = {name: data for name, data in members.items() if name.endswith(".usda")}
    others = {name: members[name] for name in sorted(members) if name not in layers}
    layers = layers or _layer(manifest, others)
    listed = {name: _describe(data) for name, data in (*layers.items(), *others.items())}
    complete = manifest.with_members(listed)
    return {**layers, MANIFEST: complete.to_bytes(), **others}


def _layer(manifest: Manifest, members: Mapping[str, bytes]) -> dict[str, bytes]:
    name = f"{asset_layer.identifier(manifest.name)}.usda"
    photometry = f"./{PHOTOMETRY}" if PHOTOMETRY in members else ""
    paths = asset_layer.Paths(f"./{MANIFEST}", f"./{name}", photometry=photometry)
    count = len(manifest.finishes)
    surface = Surface.from_members(members.__getitem__, finish_count=count)
    return {name: asset_layer.layer_text(manifest, surface, paths).encode()}


def _describe(data: bytes) -> Member:
    return Member(len(data), hashlib.sha256(data).hexdigest())
