"""Ray files that are cut, mutated, or lie about their counts: rays or one line."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.files import read_ray_file
from tests.support.rays import ball, geometry, tm25, zemax

ROWS = np.concatenate([geometry(ball(64)), np.full((64, 1), 0.5)], 1).astype(np.float32)
TM25 = tm25(ROWS, (1, 1, 1, 0, 0, 0, 0, 0), spectral=3, spectra=[[(450.0, 1.0), (600.0, 2.0)]])
TEXT = ("64 4\n" + "\n".join(" ".join(f"{x:.6g}" for x in row) for row in ROWS)).encode()
SEEDS = {"tm25": TM25, "zemax": zemax(ROWS, flux_kind=1), "text": TEXT}
HEADS = {"tm25": 288, "zemax": 208, "text": 200}  # Where most of the mutants strike.
ROUNDS = 250


def survives(path: Path, data: bytes) -> bool:
    """Whether the file is read; anything but rays of finite numbers or one line is a fault."""
    path.write_bytes(data)
    try:
        rays = rays_of(read_ray_file(path))
    except PureLightError as error:
        if "\n" in str(error):
            raise ValueError("more than a line") from error
        return False
    for column in (rays.position, rays.direction, rays.power):
        assert np.isfinite(column).all()
    assert (rays.power >= 0).all()
    return True


def mutant(data: bytes, head: int, rng: np.random.Generator) -> bytes:
    """The end cut off, or some numbers replaced, in the header above all."""
    if rng.random() < 0.2:
        return data[: rng.integers(len(data))]
    spoilt = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        place = int(rng.integers(head if rng.random() < 0.7 else len(data) - 8)) & ~3
        word = rng.choice([0, 1, -1, 2**31 - 1, -(2**31), 0x7FC00000, 0x7F800000, 77])
        spoilt[place : place + 4] = struct.pack("<i", int(word))
    return bytes(spoilt)


@pytest.mark.parametrize("name", SEEDS)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_mutants(name: str, tmp_path: Path) -> None:
    rng, path = np.random.default_rng(3), tmp_path / "led.dat"
    assert survives(path, SEEDS[name])
    read = sum(survives(path, mutant(SEEDS[name], HEADS[name], rng)) for _ in range(ROUNDS))
    assert read < ROUNDS


def test_noise(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    for start in (b"", b"TM25", struct.pack("<i", 1010)):
        for size in (0, 300, 40_000):
            noise = rng.integers(256, size=size, dtype=np.uint8).tobytes()
            assert not survives(tmp_path / "led.dat", start + noise)
