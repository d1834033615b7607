"""JSON without its loose ends: no NaN, no infinities, no duplicate keys, bounded size and depth."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import Any, NoReturn

from purelight_format.issues import fail
from purelight_format.limits import LIMITS, Limits


def loads(data: bytes, where: str, limits: Limits = LIMITS) -> Any:
    """Parses strict JSON.

    Arguments:
        data: UTF-8 without a byte-order mark.
        where: the location that issues name.
        limits: what is accepted.

    Raises:
        FormatError: With a PLX_JSON code.
    """
    if len(data) > limits.manifest_bytes:
        fail("PLX_JSON_TOO_LARGE", where, size=len(data), limit=limits.manifest_bytes)
    text = _decode(data, where)
    _require_depth(text, where, limits.json_depth)
    try:
        value = json.loads(
            text,
            object_pairs_hook=lambda pairs: _unique(pairs, where),
            parse_float=lambda number: _finite(number, where, limits.json_number_digits),
            parse_int=lambda number: _integer(number, where, limits.json_number_digits),
            parse_constant=lambda name: _non_finite(name, where),
        )
        dumps(value)
    except UnicodeEncodeError as error:  # A lone surrogate, which only an escape can smuggle in.
        fail("PLX_JSON_ENCODING", where, offset=error.start)
    except ValueError as error:
        fail("PLX_JSON_SYNTAX", where, error=str(error)[:80])
    return value


def dumps(value: Any) -> bytes:
    """Serialises with the keys in their order: the same value gives the same bytes."""
    return (json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def shown(value: Any) -> str:
    """The same in ASCII, for terminals of any encoding: what a file says cannot steer one."""
    return json.dumps(value, indent=2, ensure_ascii=True, allow_nan=False)


def _decode(data: bytes, where: str) -> str:
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        fail("PLX_JSON_ENCODING", where, offset=error.start)
    if text.startswith("\ufeff"):
        fail("PLX_JSON_ENCODING", where, offset=0)
    return text


def _require_depth(text: str, where: str, limit: int) -> None:
    """Bounds the nesting before the recursive parser sees the text."""
    depth, quoted, escaped = 0, False, False
    for character in text:
        if quoted:
            quoted = escaped or character != '"'
            escaped = character == "\\" and not escaped
        elif character == '"':
            quoted = True
        elif character in "[{":
            depth += 1
            if depth > limit:
                fail("PLX_JSON_TOO_DEEP", where, limit=limit)
        elif character in "]}":
            depth -= 1


def _unique(pairs: list[tuple[str, Any]], where: str) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) != len(pairs):
        counts = Counter(name for name, _ in pairs)
        fail("PLX_JSON_DUPLICATE_KEY", where, key=max(counts, key=counts.__getitem__)[:80])
    return result


def _finite(number: str, where: str, digits: int) -> float:
    value = float(number) if len(number) <= digits else math.inf
    return value if math.isfinite(value) else _non_finite(number, where)


def _integer(number: str, where: str, digits: int) -> int:
    if len(number) > digits:
        _non_finite(number, where)
    return int(number)


def _non_finite(number: str, where: str) -> NoReturn:
    fail("PLX_JSON_NON_FINITE", where, number=number[:40])
