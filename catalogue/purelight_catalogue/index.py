"""`catalogue.json`: the catalogue for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from purelight_catalogue.catalogue import Card
from purelight_format import atomic
from purelight_format.color import lumens
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge

FORMAT = 1


def card_json(card: Card) -> dict[str, Any]:
    """One lamp: its name, files, light, size, verdict, cost, or why it is not there."""
    if card.fault:
        return {"name": card.entry.name, "source": card.entry.file.name, "fault": card.fault}
    about = card.about["manifest"]
    return {
        "name": card.entry.name,
        "title": about["name"],
        "source": card.entry.file.name,
        "files": dict(card.files),
        "digest": card.about["digest"],
        "bytes": card.about["bytes"],
        "lumens": round(lumens(about["flux"]), 2),
        "flux": about["flux"],
        "metres": 2 * about["bounding_sphere"]["radius"],
        "networks": sorted(about["networks"]),
        "multiply_adds": about["networks"]["appearance"]["macs_per_sample"],
        "triangles": card.about["triangles"],
        "verdict": _verdict(about),
        "fidelity": about["fidelity"],
        "photons": dict(card.photons),
        "seconds": card.seconds,
        "gibibytes": card.gibibytes,
        "warnings": list(card.warnings),
    }


def _verdict(about: Mapping[str, Any]) -> dict[str, Any]:
    """What the lamp is worth in words, as all commands say it; nothing if it was not measured."""
    found = read(about["fidelity"].get("verdict"))
    if found is None:
        return {}
    words = judge(found, about["provenance"])
    return {
        "light": words.light, "look": words.look, "fast": words.fast, "caption": words.caption,
        "lines": list(words.lines),
    }  # fmt: skip


def write_index(cards: Sequence[Card], output: Path) -> Path:
    """Write the index, lamps by name; those that failed come with their reason."""
    found = [card_json(card) for card in cards]
    data = {
        "format": FORMAT,
        "lamps": [one for one in found if "fault" not in one],
        "failed": [one for one in found if "fault" in one],
    }
    path = output / "catalogue.json"
    atomic.write_bytes(path, (json.dumps(data, indent=1) + "\n").encode())
    return path
