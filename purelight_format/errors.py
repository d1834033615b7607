"""The one exception a user's input can cause, and the one warning of a network's answers."""

from __future__ import annotations


class PureLightError(Exception):
    """A fault the user can mend: one line that says what is wrong and what to do."""


class SpoiltWarning(UserWarning):
    """Answers of networks that were infinite or no number.

    Arguments:
        count: how many.
    """

    def __init__(self, count: int) -> None:
        text = f"{count} answers of networks were infinite or no number; they count as dark"
        super().__init__(text)
