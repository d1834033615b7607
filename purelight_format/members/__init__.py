"""The names of a bundle's members."""

from __future__ import annotations

MANIFEST = "manifest.json"
PHOTOMETRY = "photometry.ies"
PREVIEW = "preview.png"
EXTENSIONS = "extensions/"


def network(name: str) -> str:
    """Where a network's ONNX bytes lie."""
    return f"networks/{name}.onnx"
