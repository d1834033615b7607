"""The manifest: what a bundle is, what it holds, and what its networks cost and achieve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from purelight_format.issues import Findings, FormatError, Issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.measures import BoundingSphere
from purelight_format.members import MANIFEST, finishes, strict_json
from purelight_format.members.finishes import Finish
from purelight_format.members.manifest_reader import Reader

FORMAT_VERSION = "1.0"
SMALLEST, LARGEST = 1e-6, 1e6  # Metres, and the latter radii.
LONGEST_NAME = 200  # Characters.
FAINTEST = 1e-30  # Watts, and W/(m² sr); float32 has nothing below 1e-38.
UNITS = {
    "length": "m",
    "flux": "W",
    "radiance": "W/(m2 sr)",
    "color_space": "lin_rec709_scene",
    "up_axis": "Z",
}


@dataclass(frozen=True)
class Member:
    """Size in bytes and SHA-256 (hexadecimal) of a member."""

    size: int
    sha256: str


@dataclass(frozen=True)
class NetworkInfo:
    """A network of the bundle.

    Arguments:
        member: where its ONNX bytes lie.
        macs_per_sample: multiply-adds of its matrix products.
        floats_per_sample: elements of all its intermediates.
        bytes: size of the member.
        uniform_fraction: for the sampler, the weight b of the uniform cap in its density.
        extra: fields this version does not know.
    """

    member: str
    macs_per_sample: int
    floats_per_sample: int
    bytes: int
    uniform_fraction: float | None = None
    extra: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Manifest:
    """Content of manifest.json.

    Arguments:
        name: what people call the lamp.
        bounding_sphere: in metres, luminaire frame.
        flux: emitted W per linear Rec.709 channel.
        radiance_scale: mean exitant radiance in W/(m² sr), the unit of small and large.
        r_max: farthest trained distance of shading points, in radii.
        channels: which of R, G, B carry flux; absent ones are exactly zero.
        networks: by name, see `kinds.KINDS`.
        provenance: where the bundle comes from (scene digest, seed, photons, preset).
        fidelity: measured errors against the light-traced lamp; its `verdict` is read by
            `verdict.figures`.
        finishes: what the sides of the exit surface's triangles are made of.
        extensions: content by reverse-domain name of who defines it.
        members: every member but the manifest; filled by `bundle.write`.
        tier: what every network keeps to, a key of `tiers.TIERS` or one of another version.
        format_version: major.minor.
        extra: fields this version does not know.
    """

    name: str
    bounding_sphere: BoundingSphere
    flux: tuple[float, float, float]
    radiance_scale: float
    r_max: float
    channels: tuple[bool, bool, bool]
    networks: dict[str, NetworkInfo]
    provenance: dict[str, Any] = field(default_factory=dict)
    fidelity: dict[str, Any] = field(default_factory=dict)
    finishes: tuple[Finish, ...] = ()
    extensions: dict[str, Any] = field(default_factory=dict)
    members: dict[str, Member] = field(default_factory=dict)
    tier: str | None = None
    format_version: str = FORMAT_VERSION
    extra: dict[str, Any] = field(default_factory=dict)

    def with_members(self, members: Mapping[str, Member]) -> Manifest:
        """A copy that lists these members."""
        return replace(self, members=dict(members))

    def to_bytes(self) -> bytes:
        """Serialises to JSON; the same manifest gives the same bytes."""
        return strict_json.dumps(to_json(self))


def to_json(manifest: Manifest) -> dict[str, Any]:
    """The manifest as JSON values."""
    sphere = manifest.bounding_sphere
    return {
        "format_version": manifest.format_version,
        "name": manifest.name,
        "units": UNITS,
        "bounding_sphere": {
            "center": [float(x) for x in sphere.center], "radius": float(sphere.radius)
        },
        "flux": [float(x) for x in manifest.flux],
        "radiance_scale": float(manifest.radiance_scale),
        "r_max": float(manifest.r_max),
        "channels": [bool(x) for x in manifest.channels],
        "networks": {name: _network_to_json(info) for name, info in manifest.networks.items()},
        "provenance": manifest.provenance,
        "fidelity": manifest.fidelity,
        **finishes.to_json(manifest.finishes),
        "extensions": manifest.extensions,
        **({} if manifest.tier is None else {"tier": manifest.tier}),
        "members": {
            name: {"size": m.size, "sha256": m.sha256} for name, m in manifest.members.items()
        },
        **manifest.extra,
    }  # fmt: skip


def _network_to_json(info: NetworkInfo) -> dict[str, Any]:
    known = {
        "member": info.member,
        "macs_per_sample": info.macs_per_sample,
        "floats_per_sample": info.floats_per_sample,
        "bytes": info.bytes,
    }
    if info.uniform_fraction is not None:
        known["uniform_fraction"] = info.uniform_fraction
    return {**known, **info.extra}


def parse(data: bytes) -> Manifest:
    """Reads manifest.json.

    Raises:
        FormatError: With the first error found.
    """
    manifest, issues = examine(data)
    for found in issues:
        if found.is_error:
            raise FormatError(found)
    assert manifest is not None  # A manifest without an error was built.
    return manifest


def examine(data: bytes, limits: Limits = LIMITS) -> tuple[Manifest | None, list[Issue]]:
    """Reads manifest.json and reports everything that is wrong with it.

    Arguments:
        data: its bytes.
        limits: what is accepted.

    Returns:
        The manifest, None if there is an error; and the issues.
    """
    try:
        value = strict_json.loads(data, MANIFEST, limits)
    except FormatError as error:
        return None, [error.issue]
    reader = Reader(value, MANIFEST, Findings(limits.issues))
    if not reader.version("format_version", FORMAT_VERSION):
        return None, list(reader.findings)
    manifest = _read(reader, limits)
    return (None if reader.failed else manifest), list(reader.findings)


def _read(reader: Reader, limits: Limits) -> Manifest:
    manifest = Manifest(
        format_version=reader.text("format_version"),
        name=reader.text("name", LONGEST_NAME),
        bounding_sphere=_read_sphere(reader.object("bounding_sphere")),
        flux=reader.vector("flux"),
        radiance_scale=reader.number("radiance_scale"),
        r_max=reader.number("r_max"),
        channels=reader.flags("channels"),
        networks={name: _read_network(r) for name, r in reader.objects("networks")},
        provenance=reader.free("provenance"),
        fidelity=reader.free("fidelity"),
        finishes=finishes.read_all(reader, "finishes", limits),
        extensions=reader.free("extensions"),
        members={name: _read_member(r) for name, r in reader.objects("members")},
        tier=reader.optional_text("tier", 64),
    )
    reader.units("units", UNITS)
    if not reader.failed:
        _require_sense(manifest, reader)
    return replace(manifest, extra=reader.rest())


def _read_sphere(reader: Reader) -> BoundingSphere:
    sphere = BoundingSphere(reader.vector("center"), reader.number("radius"))
    reader.rest()
    return sphere


def _read_member(reader: Reader) -> Member:
    member = Member(reader.count("size"), reader.digest("sha256"))
    reader.rest()
    return member


def _read_network(reader: Reader) -> NetworkInfo:
    info = NetworkInfo(
        member=reader.text("member"),
        macs_per_sample=reader.count("macs_per_sample"),
        floats_per_sample=reader.count("floats_per_sample"),
        bytes=reader.count("bytes"),
        uniform_fraction=reader.fraction("uniform_fraction"),
    )
    return replace(info, extra=reader.rest())


def _require_sense(manifest: Manifest, reader: Reader) -> None:
    """Physical sense of the values, rules m6 to m9."""
    sphere = manifest.bounding_sphere
    if not SMALLEST <= sphere.radius <= LARGEST or max(map(abs, sphere.center)) > LARGEST:
        reader.add("PLX_MANIFEST_SPHERE_INVALID", "bounding_sphere")
    channels = zip(manifest.flux, manifest.channels, strict=True)
    if any(not bright(flux) if present else flux != 0 for flux, present in channels):
        reader.add("PLX_MANIFEST_FLUX_INVALID", "flux")
    if not any(manifest.channels):
        reader.add("PLX_MANIFEST_DARK", "channels")
    if not bright(manifest.radiance_scale):
        reader.add("PLX_MANIFEST_SCALE_INVALID", "radiance_scale")
    if not 1 < manifest.r_max <= LARGEST:
        reader.add("PLX_MANIFEST_RMAX_INVALID", "r_max")


def bright(value: float) -> bool:
    """Whether a quantity of light is far from what float32 cannot hold, or holds as zero."""
    return FAINTEST <= value <= 1 / FAINTEST
