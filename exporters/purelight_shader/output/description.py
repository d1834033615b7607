"""lamp.json: what a host must know of the files beside it, in numbers and names of ours."""

from __future__ import annotations

import json
from typing import Any

from purelight_shader.form.elements import Kind
from purelight_shader.form.statements import Port
from purelight_shader.form.store import FOUR
from purelight_shader.output.vectors import SelfTest
from purelight_shader.targets.slang_module import TEXTURE_WIDTH
from purelight_shader.translation import Translation, function

VERSION = 1


def description(
    translation: Translation, test: SelfTest, language: str, prefix: str
) -> dict[str, Any]:
    """The content of lamp.json."""
    bundle, store = translation.bundle, translation.store
    about, surface = bundle.manifest, bundle.surface()
    sampler = about.networks.get("sampler")
    return {
        "version": VERSION,
        "language": language,
        "prefix": prefix,
        "bundle": bundle.digest,
        "functions": [
            {
                "network": network,
                "name": f"{prefix}_{function(network)}",
                "inputs": [_port(port) for port in program.inputs],
                "outputs": [_port(port) for port in program.outputs],
                "macs": about.networks[network].macs_per_sample,
            }
            for network, program in translation.programs.items()
        ],
        "floats": _buffer(store.size(Kind.FLOAT), "float32"),
        "integers": _buffer(store.size(Kind.INT), "int32"),
        "texture_width": TEXTURE_WIDTH,
        "lamp": {
            "center": [float(x) for x in about.bounding_sphere.center],
            "radius": float(about.bounding_sphere.radius),
            "flux": [float(x) for x in about.flux],
            "radiance_scale": float(about.radiance_scale),
            "r_max": float(about.r_max),
            "channels": [bool(x) for x in about.channels],
            "uniform_fraction": (sampler.uniform_fraction if sampler else None) or 0.0,
        },
        "surface": {"vertices": len(surface.positions), "triangles": len(surface.triangles)},
        "selftest": {
            "rows": len(test.inputs),
            "inputs": test.inputs.shape[1],
            "outputs": test.expected.shape[1],
            "networks": list(test.networks),
        },
    }


def to_bytes(content: dict[str, Any]) -> bytes:
    """As a file."""
    return json.dumps(content, indent=2, allow_nan=False).encode() + b"\n"


def _port(port: Port) -> dict[str, Any]:
    return {"name": port.name, "shape": list(port.shape)}


def _buffer(size: int, kind: str) -> dict[str, Any]:
    """Counted in fours; a texture has them in rows of `texture_width`."""
    fours = size // FOUR
    return {"type": kind, "fours": fours, "texture_rows": -(-fours // TEXTURE_WIDTH)}
