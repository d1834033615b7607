"""What made a result: a version of this library, and of its code where it is being worked on."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import import_module, metadata
from pathlib import Path

MAKERS = (
    "purelight_format", "purelight_import", "purelight_train", "purelight_export", "purelight_onnx",
)  # fmt: skip


@cache
def version() -> str:
    """The library's version and a digest of the code that makes a lamp's files.

    Code that is being changed makes other results under the same version, and a result must not
    stand for another's.
    """
    digest = hashlib.sha256()
    for name in MAKERS:
        home = Path(str(import_module(name).__file__)).parent
        for path in sorted(home.rglob("*.py")):
            digest.update(str(path.relative_to(home)).encode() + b"\0" + path.read_bytes())
    return f"{metadata.version('purelight')} {digest.hexdigest()[:16]}"
