"""PureLight's luminaires in Mitsuba 3."""

from __future__ import annotations

from purelight_mitsuba.platform import prepare, use

__all__ = ["register", "use"]

prepare()


def register() -> None:
    """Registers PureLight's plugins for the variant in use."""
