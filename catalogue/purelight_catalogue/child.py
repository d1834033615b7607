"""A command of this library in a process that does not outlive the worker that started it.

python -m purelight_catalogue.child PARENT MODULE[:FUNCTION] [ARGUMENT ...]
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from importlib import import_module

PR_SET_PDEATHSIG = 1


def follow(parent: int) -> None:
    """End with the parent, where the system can see to it (Linux)."""
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        sys.exit(1)  # It ended before


def main() -> int:
    """Run the command that the arguments name."""
    parent, place, *words = sys.argv[1:]
    follow(int(parent))
    module, _, name = place.partition(":")
    code: int = getattr(import_module(module), name or "main")(words)
    return code


if __name__ == "__main__":
    sys.exit(main())
