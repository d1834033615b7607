"""Typed access to JSON objects that notes every fault instead of stopping at the first."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from purelight_format.issues import LONGEST, Findings, issue

VERSION = re.compile(r"(0|[1-9][0-9]{0,3})\.(0|[1-9][0-9]{0,3})")
ABSENT = object()  # What a field is that is not there; null is a value, and none that fits.
DIGEST = re.compile(r"[0-9a-f]{64}")


class Reader:
    """One JSON object; a field that is read is known, the others are the `rest`.

    Arguments:
        value: the JSON value, which should be an object.
        pointer: its location.
        findings: where issues are noted, shared by the readers of one file.
    """

    def __init__(self, value: Any, pointer: str, findings: Findings | None = None) -> None:
        self.findings = Findings() if findings is None else findings
        self.pointer = pointer[: 4 * LONGEST]  # A key may be long, and have many fields.
        self._value = value if isinstance(value, dict) else {}
        self._known: set[str] = set()
        if not isinstance(value, dict):
            expected = "must be an object"
            self.findings.add(issue("PLX_MANIFEST_SCHEMA", self.pointer, expected=expected))

    @property
    def failed(self) -> bool:
        return bool(self.findings.errors)

    def add(self, code: str, key: str, **values: Any) -> None:
        """Notes an issue of a field."""
        self.findings.add(issue(code, f"{self.pointer}/{_escaped(key)}", **values))

    def _get(self, key: str) -> Any:
        self._known.add(key)
        return self._value.get(key, ABSENT)

    def _wrong(self, key: str, expected: str) -> None:
        self.add("PLX_MANIFEST_SCHEMA", key, expected=expected)

    def text(self, key: str, longest: int = 260) -> str:
        """A printable string of at most `longest` characters."""
        value = self._get(key)
        if isinstance(value, str) and 0 < len(value) <= longest and value.isprintable():
            return value
        self._wrong(key, f"must be a printable text of 1 to {longest} characters")
        return ""

    def optional_text(self, key: str, longest: int) -> str | None:
        """A printable string, or nothing."""
        return None if self._get(key) is ABSENT else self.text(key, longest)

    def digest(self, key: str) -> str:
        """A SHA-256 in lower-case hexadecimal."""
        value = self._get(key)
        if isinstance(value, str) and DIGEST.fullmatch(value):
            return value
        self._wrong(key, "must be 64 lower-case hexadecimal digits")
        return ""

    def count(self, key: str) -> int:
        """A whole number from 0 to 2^53."""
        value = self._get(key)
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 2**53:
            return value
        self._wrong(key, "must be a whole number, not negative")
        return 0

    def number(self, key: str) -> float:
        """A number."""
        value = self._get(key)
        if _is_number(value):
            return float(value)
        self._wrong(key, "must be a number")
        return 1.0

    def fraction(self, key: str) -> float | None:
        """A number above 0, at most 1; or nothing."""
        value = self._get(key)
        if value is ABSENT:
            return None
        if _is_number(value) and 0 < value <= 1:
            return float(value)
        self._wrong(key, "must be a number above 0, at most 1")
        return None

    def within(self, key: str, low: float, high: float, default: float) -> float:
        """A number in a range; the default if there is none."""
        value = self._get(key)
        if value is ABSENT:
            return default
        if _is_number(value) and low <= value <= high:
            return float(value)
        self._wrong(key, f"must be a number from {low:g} to {high:g}")
        return default

    def flag(self, key: str, default: bool) -> bool:
        """A truth value; the default if there is none."""
        value = self._get(key)
        if value is ABSENT or isinstance(value, bool):
            return default if value is ABSENT else bool(value)
        self._wrong(key, "must be a truth value")
        return default

    def color(
        self, key: str, default: tuple[float, float, float] | None = None
    ) -> tuple[float, float, float]:
        """Three numbers in [0, 1]; the default if there are none."""
        value = self._get(key)
        if value is ABSENT and default is not None:
            return default
        if isinstance(value, list) and len(value) == 3:
            r, g, b = (float(x) if _is_number(x) and 0 <= x <= 1 else -1.0 for x in value)
            if min(r, g, b) >= 0:
                return r, g, b
        self._wrong(key, "must be three numbers from 0 to 1")
        return (0.0, 0.0, 0.0)

    def vector(self, key: str) -> tuple[float, float, float]:
        """Three numbers."""
        value = self._get(key)
        if isinstance(value, list) and len(value) == 3 and all(_is_number(x) for x in value):
            return float(value[0]), float(value[1]), float(value[2])
        self._wrong(key, "must be three numbers")
        return (0.0, 0.0, 0.0)

    def flags(self, key: str) -> tuple[bool, bool, bool]:
        """Three truth values."""
        value = self._get(key)
        if isinstance(value, list) and len(value) == 3 and all(isinstance(x, bool) for x in value):
            return value[0], value[1], value[2]
        self._wrong(key, "must be three truth values")
        return (False, False, False)

    def object(self, key: str) -> Reader:
        """A reader of an object inside."""
        return Reader(self._get(key), f"{self.pointer}/{_escaped(key)}", self.findings)

    def objects(self, key: str) -> Iterator[tuple[str, Reader]]:
        """Readers of an object's members by name, which must all be objects."""
        inner = self.object(key)
        for name in inner._value:
            yield name, inner.object(name)

    def listed(self, key: str, most: int, too_many: str) -> list[Reader]:
        """Readers of a list's elements, which must all be objects; none if it is not there.

        Arguments:
            most: how many it may have.
            too_many: the code of the issue if it has more.
        """
        value, pointer = self._get(key), f"{self.pointer}/{_escaped(key)}"
        if value is ABSENT:
            return []
        if not isinstance(value, list):
            self._wrong(key, "must be a list")
            return []
        if len(value) > most:
            self.add(too_many, key, count=len(value), limit=most)
            return []
        return [Reader(one, f"{pointer}/{k}", self.findings) for k, one in enumerate(value)]

    def free(self, key: str) -> dict[str, Any]:
        """An object of any content; empty if it is not there."""
        value = self._get(key)
        if value is ABSENT:
            return {}
        if isinstance(value, dict):
            return value
        self._wrong(key, "must be an object")
        return {}

    def units(self, key: str, expected: dict[str, str]) -> None:
        """Exactly these units; others of a newer version are no reason to guess."""
        if self._get(key) != expected:
            text = ", ".join(f"{k} {v}" for k, v in expected.items())
            self.add("PLX_MANIFEST_UNITS", key, expected=text)

    def version(self, key: str, known: str) -> bool:
        """Whether a major.minor version can be read: a newer minor one with a warning."""
        value = self._get(key)
        match = VERSION.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            self._wrong(key, "must be a version such as 1.0")
            return False
        major, minor = (int(part) for part in known.split("."))
        if int(match[1]) != major:
            self.add("PLX_MANIFEST_VERSION_UNSUPPORTED", key, version=value, known=known)
            return False
        if int(match[2]) > minor:
            self.add("PLX_MANIFEST_VERSION_NEWER", key, version=value, known=known)
        return True

    def rest(self) -> dict[str, Any]:
        """The fields that were not read, each with a warning."""
        rest = {key: value for key, value in self._value.items() if key not in self._known}
        for key in rest:
            self.add("PLX_MANIFEST_UNKNOWN_FIELD", key)
        return rest


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _escaped(key: str) -> str:
    """A key as part of a JSON pointer (RFC 6901)."""
    return key.replace("~", "~0").replace("/", "~1")
