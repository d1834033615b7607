"""A catalogue of lamps: many at once, on one machine or on many."""

from __future__ import annotations

from purelight_format import lazy

_HOMES = {"Entry": "entries", "Settings": "jobs", "read_entries": "entries"}
__all__ = list(_HOMES)
__getattr__ = lazy.attributes(__name__, _HOMES)
