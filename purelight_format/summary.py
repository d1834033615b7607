"""One screen about a bundle: what the lamp is, can do, how big, how faithful, made from what."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from purelight_format import manifest
from purelight_format.bundle import Bundle

ABILITIES = {
    "appearance": "be looked at, and light a room",
    "transparency": "be seen through",
    "sampler": "be sampled by its own light (accurate mode)",
    "fast_map": "light a room from a 16 x 16 map (fast mode)",
}
WIDTH = 14
LONGEST = 12  # Lines for each open-ended table, so that all fits on one screen.


def summary_json(bundle: Bundle) -> dict[str, Any]:
    """The manifest with the bundle's digest, size and mesh."""
    surface = bundle.surface()
    return {
        "path": str(bundle.path),
        "digest": bundle.digest,
        "bytes": len(bundle.data),
        "vertices": len(surface.positions),
        "triangles": len(surface.triangles),
        "area": float(surface.area().sum()),
        "manifest": manifest.to_json(bundle.manifest),
    }


def summary_text(bundle: Bundle) -> str:
    """The same for people."""
    about = bundle.manifest
    lines = [
        f"{about.name}: a PureLight luminaire, format {about.format_version}",
        *_lamp(bundle),
        *(_line("can", ABILITIES[name]) for name in ABILITIES if name in about.networks),
        *_networks(bundle),
        *_table("fidelity", about.fidelity),
        *_table("made from", about.provenance),
        _line("digest", bundle.digest),
    ]
    return "\n".join(lines)


def _lamp(bundle: Bundle) -> list[str]:
    about, surface = bundle.manifest, bundle.surface()
    sphere = about.bounding_sphere
    center = ", ".join(f"{x:.4g}" for x in sphere.center)
    flux = ", ".join(f"{x:.4g}" for x in about.flux)
    dark = [name for name, on in zip("RGB", about.channels, strict=True) if not on]
    area = surface.area().sum()
    return [
        _line("size", f"radius {sphere.radius:.4g} m about ({center})"),
        _line("exit surface", f"{len(surface.triangles)} triangles, {area:.4g} m2"),
        _line("flux", f"{flux} W (R, G, B){'; dark: ' + ' '.join(dark) if dark else ''}"),
        _line(
            "radiance", f"{about.radiance_scale:.4g} W/(m2 sr) mean; r_max {about.r_max:g} radii"
        ),
    ]


def _networks(bundle: Bundle) -> list[str]:
    lines = [f"{'network':<{WIDTH}}{'size':>10}{'multiply-adds':>16}{'elements':>12}  per sample"]
    for name, info in bundle.manifest.networks.items():
        share = f"  ({info.uniform_fraction:g} uniform)" if info.uniform_fraction else ""
        lines.append(
            f"{name:<{WIDTH}}{_size(info.bytes):>10}{info.macs_per_sample:>16,}"
            f"{info.floats_per_sample:>12,}{share}"
        )
    return [*lines, _line("whole file", _size(len(bundle.data)))]


def _table(title: str, values: Mapping[str, Any]) -> list[str]:
    """Nested values as dotted names, cut to a few lines."""
    flat = list(_flatten("", values))
    lines = [_line(title if k == 0 else "", text) for k, text in enumerate(flat[:LONGEST])]
    if len(flat) > LONGEST:
        lines.append(_line("", f"and {len(flat) - LONGEST} more (--json)"))
    return lines or [_line(title, "not stated")]


def _flatten(prefix: str, value: Any) -> list[str]:
    if isinstance(value, Mapping) and value:
        return [line for k, v in value.items() for line in _flatten(f"{prefix}.{k}", v)]
    values = value if isinstance(value, list) else [value]
    line = f"{prefix[1:]} {', '.join(map(_short, values))}"
    return [line if line.isprintable() else line.encode("unicode_escape").decode()]


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(title: str, text: str) -> str:
    return f"{title:<{WIDTH}}{text[:120]}"


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
