"""What seems wrong with a lamp's scene, found before long work begins."""

from __future__ import annotations

from purelight_import.sanity.check import doubts

__all__ = ["doubts"]
