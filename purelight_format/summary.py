"""One screen about a bundle: what the lamp is, can do, how big, how faithful, made from what."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from textwrap import wrap
from typing import Any

import numpy as np

from purelight_format.bundle import Bundle
from purelight_format.color import lumens, lumens_words
from purelight_format.issues import plain
from purelight_format.members import manifest
from purelight_format.members.fidelity import fidelity_words
from purelight_format.members.finishes import Finish
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.tiers import TIERS
from purelight_format.srgb import encode
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge

ABILITIES = {name: kind.ability for name, kind in KINDS.items() if kind.ability}
WIDTH = 14
FOLD = 100
LONGEST = 9  # Lines for each open-ended table, so that all fits on one screen.
MOST_FINISHES = 6  # In its line.
METAL = 0.5


def summary_json(bundle: Bundle) -> dict[str, Any]:
    """The manifest with the bundle's digest, size and mesh."""
    surface = bundle.surface()
    return {
        "path": plain(bundle.path),
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
        f"{about.name}: a PureLight luminaire, format {about.format_version}, "
        f"{_size(len(bundle.data))}",
        *_lamp(bundle),
        *_networks(bundle),
        *([] if about.tier is None else [_line("tier", _tier(about.tier))]),
        *_verdict(about),
        *_table("faithful", _fidelity(about)),
        *_table("made from", list(_flatten("", about.provenance))),
        _line("digest", bundle.digest),
    ]
    return "\n".join(lines)


def _lamp(bundle: Bundle) -> list[str]:
    about, surface = bundle.manifest, bundle.surface()
    sphere = about.bounding_sphere
    center = ", ".join(f"{_plain(x, 1e-6 * sphere.radius):.4g}" for x in sphere.center)
    flux = ", ".join(f"{x:.4g}" for x in about.flux)
    area = surface.area().sum()
    return [
        _line("size", f"{length_words(2 * sphere.radius)} across; a sphere of radius "
                      f"{sphere.radius:.4g} m about ({center})"),
        _line("light", f"{lumens_words(lumens(about.flux))}; {flux} W (R, G, B){_color(about)}"),
        _line("radiance", f"{about.radiance_scale:.4g} W/(m2 sr) in the mean; trained to "
                          f"{about.r_max:g} radii ({length_words(about.r_max * sphere.radius)}) "
                          "away"),
        _line("exit surface", f"{len(surface.triangles):,} triangles, {_area(area)}"),
        *_finishes(about.finishes),
    ]  # fmt: skip


def _plain(value: float, negligible: float) -> float:
    """Zero for what is zero but for rounding."""
    return 0.0 if abs(value) < negligible else value


def _finishes(finishes: Sequence[Finish]) -> list[str]:
    """Of what the lamp is made, in the light of a room; names come from its maker."""
    words = dict.fromkeys(f"{plain(f.name, 40)} ({_kind(f)})" for f in finishes if _answers(f))
    told, more = list(words)[:MOST_FINISHES], len(words) - MOST_FINISHES
    text = ", ".join(told) + (f" and {more} more" if more > 0 else "")
    return [_line("finishes", text)] if told else []


def _answers(finish: Finish) -> bool:
    """Whether any light comes back from it, or goes on."""
    return not finish.opaque or finish.ior > 1 or max(finish.base_color) > 0


def _kind(finish: Finish) -> str:
    if not finish.opaque:
        return "thin glass" if finish.thin_walled else "glass"
    return "metal" if finish.metalness > METAL else "opaque"


def _color(about: manifest.Manifest) -> str:
    """The colour of the light on an sRGB screen, and the channels that are dark."""
    dark = [name for name, on in zip("RGB", about.channels, strict=True) if not on]
    if len(dark) == 3:
        return "; it gives no light"
    linear = np.array(about.flux) / max(about.flux)
    code = "".join(f"{round(float(255 * x)):02X}" for x in encode(linear))
    return f"; color #{code}{'; dark: ' + ' '.join(dark) if dark else ''}"


def _networks(bundle: Bundle) -> list[str]:
    """What the lamp can do, and with which networks at what cost."""
    known = bundle.manifest.networks
    names = [*ABILITIES, *(name for name in known if name not in ABILITIES)]
    head = f"{'network':<{WIDTH}}{'size':>9}{'multiply-adds':>15}{'values':>9}"
    return [_line("can", head), *(_network(bundle, name) for name in names[:LONGEST])]


def _network(bundle: Bundle, name: str) -> str:
    ability, info = ABILITIES.get(name, ""), bundle.manifest.networks.get(name)
    if info is None:
        return _line("  no", f"{plain(name, WIDTH - 1):<{WIDTH + 33}}   {ability}")
    share = f"; {info.uniform_fraction:g} uniform" if info.uniform_fraction else ""
    return _line(
        "  yes" if ability else "",
        f"{plain(name, WIDTH - 1):<{WIDTH}}{_size(info.bytes):>9}{info.macs_per_sample:>15,}"
        f"{info.floats_per_sample:>9,}   {ability}{share}",
    )


def _verdict(about: manifest.Manifest) -> list[str]:
    """What its maker found, in words; nothing if it does not say."""
    found = read(about.fidelity.get("verdict"))
    if found is None:
        return []
    lines = ["says its maker:", *judge(found, about.provenance).lines]
    folded = [part for line in lines for part in wrap(line, FOLD, subsequent_indent="  ")]
    return [_line("verdict" if k == 0 else "", text) for k, text in enumerate(folded)]


def _tier(name: str) -> str:
    """A tier, and what it says of the lamp."""
    known = TIERS.get(name)
    if known is None:
        return f"{plain(name, 64)}, of which this version knows nothing"
    return (
        f"{known.name}: at most {known.macs:,} multiply-adds (a map {known.map_macs:,}), "
        f"layers of {known.multiple}; for any GPU"
    )


def _fidelity(about: manifest.Manifest) -> list[str]:
    """Known figures in words, others as they are; not those of the verdict."""
    said, others = fidelity_words(about)
    if read(others.get("verdict")) is not None:
        del others["verdict"]
    return [*said, *_flatten("", others)]


# Lines


def _table(title: str, found: list[str]) -> list[str]:
    """A few lines under a title."""
    lines = [_line(title if k == 0 else "", text) for k, text in enumerate(found[:LONGEST])]
    if len(found) > LONGEST:
        lines.append(_line("", f"and {len(found) - LONGEST} more (--json)"))
    return lines or [_line(title, "not stated")]


def _flatten(prefix: str, value: Any) -> Iterator[str]:
    """Nested values as dotted names."""
    if isinstance(value, Mapping) and (value or not prefix):
        for key, inner in value.items():
            yield from _flatten(f"{prefix}.{key}", inner)
    else:
        values = value if isinstance(value, list) else [value]
        yield plain(f"{prefix[1:]} {', '.join(map(_short, values))}", 110)


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(title: str, text: str) -> str:
    return f"{title:<{WIDTH}}{text[:120]}".rstrip()


def length_words(metres: float) -> str:
    """A length in centimetres where these are few digits, else in metres."""
    small = 1e-3 <= metres < 1
    return f"{100 * metres:.3g} cm" if small else f"{metres:.4g} m"


def _area(area: float) -> str:
    return f"{1e4 * area:.4g} cm2" if area < 0.1 else f"{area:.4g} m2"


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
