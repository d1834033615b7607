"""The manifest on damaged and on made-up JSON."""

from __future__ import annotations

import json
import string
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from purelight_format.members import strict_json
from purelight_format.members.manifest import parse
from tests.fuzz.targets import manifest_comes_back
from tests.support import lamp

NUMBER = st.one_of(st.integers(-(2**53), 2**53), st.floats(allow_nan=False, allow_infinity=False))
TEXT = st.text(string.printable + "äß漢\U0001f4a1", max_size=8)
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBER, TEXT),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)
OBJECT = st.dictionaries(TEXT, JSON, max_size=4)


@settings(max_examples=100, derandomize=True, deadline=None)
@given(OBJECT, OBJECT, OBJECT, OBJECT)
def test_free_fields_come_back(one: Any, two: Any, three: Any, rest: Any) -> None:
    value = json.loads(lamp.good()["manifest.json"])
    value.update(provenance=one, fidelity=two, extensions=three)
    value = {**rest, **value}
    data = strict_json.dumps(value)
    assert manifest_comes_back(data)
    assert json.loads(parse(data).to_bytes()) == value


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.sampled_from(sorted(json.loads(lamp.good()["manifest.json"]))), JSON)
def test_any_json_in_any_field_is_answered(field: str, anything: Any) -> None:
    value = json.loads(lamp.good()["manifest.json"])
    manifest_comes_back(strict_json.dumps({**value, field: anything}))


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.one_of(st.binary(max_size=60), JSON.map(strict_json.dumps)))
def test_any_bytes_are_answered(data: bytes) -> None:
    manifest_comes_back(data)
