"""The manifest on damaged and on made-up JSON."""

from __future__ import annotations

import json
import string
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from purelight_format import manifest, strict_json
from purelight_format.issues import CODES, FormatError
from purelight_format.manifest import parse
from tests.assets import lamp
from tests.assets.mutation import mutate, rounds

WORDS = (b"NaN", b"1e999", b"-0", b"null", b"[[", b"]]", b'"\\ud800"', b"{}", b"9" * 41, b"\xff",
         b'"r_max":', b"true", b"1e-400", b'"2.0"')  # fmt: skip
NUMBER = st.one_of(st.integers(-(2**53), 2**53), st.floats(allow_nan=False, allow_infinity=False))
TEXT = st.text(string.printable + "äß漢\U0001f4a1", max_size=8)
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBER, TEXT),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)
OBJECT = st.dictionaries(TEXT, JSON, max_size=4)


def require_an_answer(data: bytes) -> bool:
    """Either issues of the table, or a manifest that comes back the same."""
    found, issues = manifest.examine(data)
    assert all(issue.code.name in CODES for issue in issues)
    assert (found is None) == any(issue.is_error for issue in issues)
    if found is not None:
        assert parse(found.to_bytes()) == found
    return found is not None


@settings(max_examples=100, derandomize=True, deadline=None)
@given(OBJECT, OBJECT, OBJECT, OBJECT)
def test_free_fields_come_back(one: Any, two: Any, three: Any, rest: Any) -> None:
    value = json.loads(lamp.good()["manifest.json"])
    value.update(provenance=one, fidelity=two, extensions=three)
    value = {**rest, **value}
    data = strict_json.dumps(value)
    assert require_an_answer(data)
    assert json.loads(parse(data).to_bytes()) == value


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.sampled_from(sorted(json.loads(lamp.good()["manifest.json"]))), JSON)
def test_any_json_in_any_field_is_answered(field: str, anything: Any) -> None:
    value = json.loads(lamp.good()["manifest.json"])
    require_an_answer(strict_json.dumps({**value, field: anything}))


@settings(max_examples=300, derandomize=True, deadline=None)
@given(st.one_of(st.binary(max_size=60), JSON.map(strict_json.dumps)))
def test_any_bytes_are_answered(data: bytes) -> None:
    require_an_answer(data)


@rounds(2_000, 200_000)
def test_damaged_manifests_are_answered(rounds: int) -> None:
    rng = np.random.default_rng(22)
    good = lamp.good()["manifest.json"]
    answers = [require_an_answer(mutate(good, rng, WORDS)) for _ in range(rounds)]
    assert 0 < sum(answers) < rounds


@rounds(3_000, 300_000)
def test_strict_json_accepts_no_more_than_json(rounds: int) -> None:
    rng = np.random.default_rng(23)
    seeds = [b'{"a": [1, 2.5e3, "x\\n", null, {"b": true}], "c": {}}', b"[[]]", b'"\\u00e4"']
    for k in range(rounds):
        data = mutate(seeds[k % 3], rng, WORDS)
        try:
            value = strict_json.loads(data, "test")
        except FormatError:
            continue
        assert value == json.loads(data)
        assert strict_json.loads(strict_json.dumps(value), "test") == value
