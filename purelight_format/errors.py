"""The one exception a user's input can cause."""

from __future__ import annotations


class PureLightError(Exception):
    """A fault the user can mend: one line that says what is wrong and what to do."""
