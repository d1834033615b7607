"""Photometric files that are cut, mutated, or lie about their counts: a table or one line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.photometry.comparison import Comparison
from purelight_format.photometry.eulumdat_reader import eulumdat_photometry
from purelight_format.photometry.eulumdat_writer import eulumdat_text
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.reader import ies_photometry
from tests.support.distributions import FULL, ies, lamp, skewed

Reader = Callable[[bytes, str], LampPhotometry]
COARSE = skewed(FULL[::3])
IES = ies(COARSE).encode()
TILTED = ies(COARSE, kind=2, tilt="INCLUDE\n1\n2\n0 90\n1 1").encode()
LDT = eulumdat_text(lamp(COARSE), maker="x", issued="2026-01-01", size=(1, 1, 1))
SEEDS = [(ies_photometry, IES), (ies_photometry, TILTED), (eulumdat_photometry, LDT)]
WORDS = [b"1e999", b"-1", b"99999999", b"1e9", b"nan", b"inf", b"", b"0", b"1.5", b"\xff", b"TILT="]
ROUNDS = 300


def survives(read: Reader, data: bytes) -> bool:
    """Whether the file is read; anything but a table of finite numbers or one line is a fault."""
    try:
        found = read(data, "lamp")
    except PureLightError as error:
        if "\n" in str(error):
            raise ValueError("more than a line") from error
        return False
    around, rows = found.table.whole
    assert np.isfinite(rows).all()
    assert (np.diff(around) > 0).all()
    assert np.isfinite(found.table.flux)
    Comparison(found, lamp()).to_text()
    return True


def mutant(data: bytes, rng: np.random.Generator) -> bytes:
    """A few words or bytes replaced, lines dropped, or the end cut off."""
    kind = rng.integers(4)
    if kind == 0:
        return data[: rng.integers(len(data))]
    if kind == 1:
        lines = data.split(b"\n")
        del lines[rng.integers(len(lines))]
        return b"\n".join(lines)
    if kind == 2:
        spoilt = bytearray(data)
        for place in rng.integers(len(data), size=rng.integers(1, 6)):
            spoilt[place] = rng.integers(256)
        return bytes(spoilt)
    words = data.split(b" ") if b" " in data[:400] else data.split(b"\r\n")
    glue = b" " if b" " in data[:400] else b"\r\n"
    words[rng.integers(min(len(words), 60))] = WORDS[rng.integers(len(WORDS))]
    return glue.join(words)


@pytest.mark.parametrize(("read", "data"), SEEDS, ids=["ies", "ies type b", "eulumdat"])
def test_mutants(read: Reader, data: bytes) -> None:
    rng = np.random.default_rng(5)
    assert survives(read, data)
    read_at_all = sum(survives(read, mutant(data, rng)) for _ in range(ROUNDS))
    assert 0 < read_at_all < ROUNDS


def test_noise() -> None:
    rng = np.random.default_rng(6)
    for size in (0, 1, 100, 10_000):
        for read in (ies_photometry, eulumdat_photometry):
            assert not survives(read, rng.integers(256, size=size, dtype=np.uint8).tobytes())


def test_counts_are_compared_with_what_is_there() -> None:
    head = b"TILT=NONE\n1 -1 1 1000000 1 1 2 0 0 0\n1 1 1\n"
    assert not survives(ies_photometry, head + b"1 " * 1000)
    assert not survives(eulumdat_photometry, LDT.replace(b"\r\n37\r\n", b"\r\n1000000\r\n", 1))
    assert not survives(ies_photometry, b"TILT=NONE\n" + b"9" * 1_000_000)
    assert not survives(ies_photometry, b"TILT" * 1_000_000)
