"""The scanner on damaged archives: one kind of exception, and no archive with two meanings."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from purelight_format import container
from purelight_format.issues import FormatError
from tests.assets import bad
from tests.assets.mutation import mutate, rounds

WORDS = (b"PK\3\4", b"PK\1\2", b"PK\5\6", b"PK\6\6", b"\x86\x19", b"\xff\xff\xff\xff", b"../")
PART = st.from_regex(r"[a-z0-9_-][a-z0-9_.-]{0,8}", fullmatch=True)
NAME = st.lists(PART, min_size=1, max_size=4).map("/".join)
MEMBERS = st.dictionaries(NAME, st.binary(max_size=200), max_size=6)


def read(data: bytes) -> dict[str, bytes] | None:
    """The members of an archive, None if it is refused."""
    try:
        entries = container.scan(data)
    except FormatError as error:
        if error.issue.code.name.startswith(("PLX_ZIP_", "PLX_FILE_")):
            return None
        raise
    return {name: bytes(container.member(data, entry)) for name, entry in entries.items()}


def require_one_meaning(data: bytes) -> bool:
    """An accepted archive is canonical, and Python's own reader sees the same in it."""
    members = read(data)
    if members is None:
        return False
    assert container.pack(members) == data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        assert {name: archive.read(name) for name in archive.namelist()} == members
    return True


@settings(max_examples=200, derandomize=True, deadline=None)
@given(MEMBERS)
def test_any_members_come_back(members: dict[str, bytes]) -> None:
    parts = [name.split("/") for name in members]
    folders = {"/".join(part[:k]) for part in parts for k in range(1, len(part))}
    assume(not folders & members.keys())
    data = container.pack(members)
    assert read(data) == members
    assert require_one_meaning(data)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_are_answered(data: bytes) -> None:
    require_one_meaning(data)


@rounds(20_000, 2_000_000)
def test_damaged_archives_are_refused_or_mean_one_thing(rounds: int) -> None:
    rng = np.random.default_rng(21)
    seeds = [container.pack({"a.usda": b"text", "b/c": b"", "d": bytes(100)}),
             bad.unchecked([("a", b"1"), ("b", b"2")]), container.pack({})]  # fmt: skip
    accepted = sum(
        require_one_meaning(mutate(seeds[k % len(seeds)], rng, WORDS)) for k in range(rounds)
    )
    assert accepted < rounds / 2  # Damage that happens to change nothing is accepted.


@pytest.mark.parametrize("field", range(11))
def test_every_field_of_a_local_header_is_read(field: int) -> None:
    """All values of each 16-bit word: only the right one is accepted."""
    good = container.pack({"name": b"data"})
    offset = 4 + 2 * field
    accepted = []
    for value in range(0, 65536, 7):
        data = good[:offset] + value.to_bytes(2, "little") + good[offset + 2 :]
        if require_one_meaning(data):
            accepted.append(data)
    assert set(accepted) <= {good}
