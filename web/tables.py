"""What the page shares with `purelight_format`, as a JavaScript module: python -m web.tables."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from purelight_format import summary
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_format.issues import CODES, LONGEST
from purelight_format.limits import LIMITS
from purelight_format.members import finishes, manifest, surface
from purelight_format.members.manifest import FORMAT_VERSION, UNITS
from purelight_format.networks import cost, operators, profile, tiers
from purelight_format.networks.kinds import KINDS, Kind
from purelight_format.summary import ABILITIES
from purelight_format.usd import layer, text
from purelight_format.usd_schema import SCHEMA
from purelight_format.validation.validate import LOOSE
from purelight_format.verdict import figures, words

PATH = Path(__file__).with_name("src") / "format/tables.js"
BARS = (
    "good", "fair", "resolved", "kept", "clear", "foggy", "smooth", "alike", "pattern", "zone",
    "faint", "grain", "by_heart",
)  # fmt: skip
HEAD = "// Written by `python -m web.tables` from purelight_format; do not edit.\n"


def tables() -> dict[str, Any]:
    """Every table by the name that it has in JavaScript."""
    return {
        "CODES": {c.name: [c.severity.value, c.message, c.anchor] for c in CODES.values()},
        "LONGEST": LONGEST,
        "LIMITS": asdict(LIMITS),
        "FORMAT_VERSION": FORMAT_VERSION,
        "UNITS": UNITS,
        "MANIFEST_BOUNDS": {
            "smallest": manifest.SMALLEST, "largest": manifest.LARGEST,
            "faintest": manifest.FAINTEST,
        },
        "KINDS": {name: _kind(kind) for name, kind in KINDS.items()},
        "ABILITIES": ABILITIES,
        "SURFACE": {"slack": surface.SPHERE_SLACK, "closure": surface.CLOSURE},
        "FINISHES": {
            "member": finishes.MEMBER, "none": finishes.NONE, "slack": finishes.ENERGY_SLACK,
            "least_ior": finishes.LEAST_IOR, "largest_ior": finishes.LARGEST_IOR,
            "largest_exponent": finishes.LARGEST_EXPONENT,
        },
        "TIERS": {
            "small": tiers.SMALL, "map_cells": tiers.MAP_CELLS,
            "known": {name: asdict(tier) for name, tier in tiers.TIERS.items()},
        },
        "VERDICT": {
            "largest": figures.LARGEST, "signed": sorted(figures.SIGNED),
            "groups": {g.__name__: _group(g) for g in (figures.Verdict, *figures.GROUPS)},
            "bars": {name: getattr(words, name.upper()) for name in BARS},
            "larger": words.LARGER, "where": words.WHERE,
        },
        "SUMMARY": {
            "fold": summary.FOLD, "finishes": summary.MOST_FINISHES, "metal": summary.METAL,
        },
        "LOOSE": LOOSE,
        "PROFILE": {"ir_version": profile.IR_VERSION, "opset": profile.OPSET, "rows": profile.ROWS},
        "FLAGS": profile.FLAGS,
        "OPERATORS": {
            name: [entry.least, entry.most, list(entry.attributes)]
            for name, entry in sorted(operators.OPERATORS.items())
        },
        "COST": {
            "call": cost.CALL, "name": cost.NAME, "product": cost.PRODUCT, "element": cost.ELEMENT,
            "integer_division": cost.INTEGER_DIVISION, "large_table": cost.LARGE_TABLE,
            "distant": cost.DISTANT, "float_remainder": cost.FLOAT_REMAINDER,
            "folding": cost.FOLDING, "combining": cost.COMBINING,
        },
        "USD": {
            "schema": SCHEMA, "endings": layer.ENDINGS, "brackets": text.BRACKETS,
            "types": sorted(text.TYPES), "layer_fields": sorted(text.LAYER_FIELDS),
            "prim_fields": sorted(text.PRIM_FIELDS),
            "property_fields": sorted(text.PROPERTY_FIELDS),
            "composing": text.COMPOSING, "specifiers": text.SPECIFIERS,
        },
        "LUMINANCE": LUMINANCE.tolist(),
        "LUMENS_PER_WATT": LUMENS_PER_WATT,
    }  # fmt: skip


def _group(group: Any) -> list[list[Any]]:
    """Name, group of figures if it is no number, and whether it may be left out, of each field."""
    return [[field, None if inner is None else inner.__name__, optional]
            for field, inner, optional in figures.layout(group)]  # fmt: skip


def _kind(kind: Kind) -> dict[str, Any]:
    """A kind of network; `units` are 1 and the factor of the radiance scale of each output."""
    at_zero, at_one = kind.units(0.0), kind.units(1.0)
    return {
        "inputs": {name: list(given.shape) for name, given in kind.inputs.items()},
        "outputs": {name: list(answer.shape) for name, answer in kind.outputs.items()},
        "units": {name: [at_zero[name], at_one[name] - at_zero[name]] for name in at_zero},
        "ranges": {name: _range(answer.range) for name, answer in kind.outputs.items()},
        "shining": [name for name, answer in kind.outputs.items() if answer.shines],
        "needs": list(kind.needs),
        "required": kind.required,
        "ability": kind.ability,
    }


def _range(limits: tuple[float, float]) -> list[float | None]:
    """A least and a largest value; JSON knows no infinity."""
    return [limit if math.isfinite(limit) else None for limit in limits]


def module() -> str:
    """The text of `PATH`."""
    lines = [f"\nexport const {k} = {json.dumps(v, indent=2)};\n" for k, v in tables().items()]
    return HEAD + "".join(lines)


if __name__ == "__main__":
    PATH.write_text(module())
