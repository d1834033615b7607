"""The C++ runtime: a header that generated lamps are written for, and their library for Python."""

from importlib.resources import files

__all__ = ["HEADER", "INTERFACE", "source"]

HEADER = "purelight.h"
INTERFACE = "purelight_c.h"


def source(name: str) -> str:
    """The text of `HEADER` or `INTERFACE`."""
    return files(__name__).joinpath(name).read_text("utf-8")
