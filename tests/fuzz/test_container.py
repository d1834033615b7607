"""The scanner on damaged archives: one kind of exception, and no archive with two meanings."""

from __future__ import annotations

import re

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from purelight_format.members import container
from tests.fuzz import targets

DEVICE = re.compile(r"(aux|con|nul|prn|com\d|lpt\d)(\.|$)")
PART = st.from_regex(r"[a-z0-9_]([a-z0-9_.-]{0,7}[a-z0-9_-])?", fullmatch=True).filter(
    lambda part: not DEVICE.match(part)
)
NAME = st.lists(PART, min_size=1, max_size=4).map("/".join)
MEMBERS = st.dictionaries(NAME, st.binary(max_size=200), max_size=6)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(MEMBERS)
def test_any_members_come_back(members: dict[str, bytes]) -> None:
    parts = [name.split("/") for name in members]
    folders = {"/".join(part[:k]) for part in parts for k in range(1, len(part))}
    assume(not folders & members.keys())
    data = container.pack(members)
    assert targets.members(data) == members
    assert targets.one_meaning(data)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.binary(max_size=300))
def test_any_bytes_are_answered(data: bytes) -> None:
    targets.one_meaning(data)


@pytest.mark.parametrize("field", range(11))
def test_every_field_of_a_local_header_is_read(field: int) -> None:
    """All values of each 16-bit word: only the right one is accepted."""
    good = container.pack({"name": b"data"})
    offset = 4 + 2 * field
    accepted = []
    for value in range(0, 65536, 7):
        data = good[:offset] + value.to_bytes(2, "little") + good[offset + 2 :]
        if targets.one_meaning(data):
            accepted.append(data)
    assert set(accepted) <= {good}
