"""Random damage to bytes and texts, from a seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

INTERESTING = (0, 1, 4, 63, 64, 0x7F, 0x80, 0xFF)


def rounds(quick: int, thorough: int) -> pytest.MarkDecorator:
    """Runs a test with a quick number of rounds, and with a thorough one among the slow tests."""
    return pytest.mark.parametrize(
        "rounds", [quick, pytest.param(thorough, marks=pytest.mark.slow)]
    )


def mutate(data: bytes, rng: np.random.Generator, words: Sequence[bytes] = ()) -> bytes:
    """Damages bytes in one to four places; `words` are pieces that the format knows."""
    for _ in range(int(rng.integers(1, 5))):
        data = _once(data, rng, words)
    return data


def _once(data: bytes, rng: np.random.Generator, words: Sequence[bytes]) -> bytes:
    start = int(rng.integers(0, len(data) + 1))
    end = min(len(data), start + int(2 ** rng.uniform(0, 7)))
    match int(rng.integers(0, 7 if words else 6)):
        case 0:
            return data[:start] + bytes([int(rng.choice(INTERESTING))]) + data[start + 1 :]
        case 1:
            return data[:start] + rng.bytes(1) + data[start + 1 :]
        case 2:
            return data[:start] + data[end:]
        case 3:
            return data[:start] + data[start:end] + data[start:]
        case 4:
            number = int(rng.choice([0, 1, len(data), 0xFFFF, 0xFFFFFFFF]))
            word = (number & 0xFFFFFFFF).to_bytes(4, "little")[: int(rng.choice([2, 4]))]
            return data[:start] + word + data[start + len(word) :]
        case 5:
            other = int(rng.integers(0, len(data) + 1))
            return data[:start] + data[other : other + end - start] + data[end:]
        case _:
            return data[:start] + words[int(rng.integers(len(words)))] + data[end:]
