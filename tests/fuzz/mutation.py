"""Random damage to bytes and texts, from a seed."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

INTERESTING = (0, 1, 4, 63, 64, 0x7F, 0x80, 0xFF)
NUMBERS = (0, 1, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF)


def mutate(data: bytes, rng: Random, words: Sequence[bytes] = ()) -> bytes:
    """Damages bytes in one to four places; `words` are pieces that the format knows."""
    for _ in range(rng.randrange(1, 5)):
        data = _once(data, rng, words)
    return data


def _once(data: bytes, rng: Random, words: Sequence[bytes]) -> bytes:
    start = rng.randrange(len(data) + 1)
    end = min(len(data), start + int(2 ** rng.uniform(0, 7)))
    match rng.randrange(7 if words else 6):
        case 0:
            return data[:start] + bytes([rng.choice(INTERESTING)]) + data[start + 1 :]
        case 1:
            return data[:start] + rng.randbytes(1) + data[start + 1 :]
        case 2:
            return data[:start] + data[end:]
        case 3:
            return data[:start] + data[start:end] + data[start:]
        case 4:
            number = rng.choice((*NUMBERS, len(data))) & 0xFFFFFFFF
            word = number.to_bytes(4, "little")[: rng.choice((2, 4))]
            return data[:start] + word + data[start + len(word) :]
        case 5:
            other = rng.randrange(len(data) + 1)
            return data[:start] + data[other : other + end - start] + data[end:]
        case _:
            return data[:start] + rng.choice(words) + data[rng.choice((start, end)) :]
