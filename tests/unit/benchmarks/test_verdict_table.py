"""What a table of verdicts says of claims beside what was found."""

from __future__ import annotations

import dataclasses

import pytest

from benchmarks.verdict.table import HEAD, row
from tests.support.verdicts import FINE

HOLDS = HEAD.index("(noise)") + 1


@pytest.mark.parametrize(
    ("within", "noise", "word"),
    [
        (0.03, 0.01, "yes"),
        (0.045, 0.01, "yes, but farther off"),
        (0.07, 0.01, "found fair"),
        (0.3, 0.01, "found poor"),
        (0.3, 0.31, "lost in noise"),
        (0.03, 0.31, "yes"),
    ],
)
def test_a_claim_is_judged_as_far_as_noise_can_tell(within: float, noise: float, word: str) -> None:
    found = {
        "accurate": {"within": within, "noise": noise, "mean": 0.0},
        "fast": {"within": 0.06, "noise": noise, "mean": 0.0},
        "look": dataclasses.asdict(FINE.look) if FINE.look else None,
    }
    assert row("lamp", FINE, found)[HOLDS] == word
