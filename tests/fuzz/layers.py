"""Layers drawn from a larger grammar than the format's, so that what is refused is tried as well.

Every place takes what belongs there, most of the time, and otherwise anything that OpenUSD's own
grammar has, with paths that lead outside wherever a path or a text may stand.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

from purelight_format.usd.text import (
    COMPOSING,
    LAYER_FIELDS,
    PRIM_FIELDS,
    PROPERTY_FIELDS,
    TYPES,
)  # fmt: skip

BAIT = ("/outside.usda", "./../outside.usda", "outside.usd", "http://h/x.json", "/outside.json",
        "./manifest.json", "./photometry.ies", "")  # fmt: skip
QUOTES = ('"{}"', "'{}'", '"""{}"""', "'''{}'''", "@{}@", "@@@{}@@@")
SPACES = (" ", "\n", "\t", "  ", " # a comment\n", "", "\r\n", " /* a */ ", ";")
ODD_TYPES = ("pathExpression", "opaque", "group", "dictionary", "rel", "asset", "string", "Token")
ODD_FIELDS = (*COMPOSING, "variants", "variantSets", "payload", "instanceable", "symmetryFunction",
              "connect", "nameChildren", "permission", "customData", "assetInfo")  # fmt: skip
FIELD_TYPES = {
    **dict.fromkeys(("customLayerData", "customData", "assetInfo", "clips"), "dictionary"),
    **dict.fromkeys(("endTimeCode", "framesPerSecond", "kilogramsPerUnit", "startTimeCode",
                     "timeCodesPerSecond"), "double"),
    **dict.fromkeys(("active", "hidden"), "bool"),
    "elementSize": "int", "allowedTokens": "token[]", "apiSchemas": "token[]",
}  # fmt: skip
EDITS = ("prepend ", "append ", "add ", "delete ", "reorder ")
SUFFIXES = (".connect", ".timeSamples", ".spline", ".default", " . timeSamples", ".mapper")
DEEP = 4


class Layers:
    """One layer from one generator of random numbers."""

    def __init__(self, rng: Random) -> None:
        self._rng, self._odd = rng, rng.choice((0.0, 0.02, 0.1))

    def _strange(self) -> bool:
        return self._rng.random() < self._odd

    def _space(self) -> str:
        return self._rng.choice(SPACES) if self._strange() else " "

    def _some(self, make: Callable[[], str], most: int) -> str:
        return "".join(f"{make()}\n" for _ in range(self._rng.randrange(most + 1)))

    def layer(self) -> str:
        needed = 'defaultPrim = "a"\nmetersPerUnit = 1\nupAxis = "Z"\n'
        fields = self._some(
            lambda: self._field(LAYER_FIELDS - {"defaultPrim", "metersPerUnit", "upAxis"}), 2
        )
        api = 'prepend apiSchemas = ["PureLightLuminaireAPI"]\n'
        body = self._body(0)
        return (f"#usda 1.0\n(\n{needed}{fields})\n\n"
                f'def Xform "a" ({api}{self._some(lambda: self._field(PRIM_FIELDS), 2)})\n'
                f"{{\n{body}}}\n")  # fmt: skip

    def _body(self, depth: int) -> str:
        return self._some(lambda: self._member(depth), 3)

    def _member(self, depth: int) -> str:
        if depth < DEEP and self._rng.random() < 0.2:
            kind = self._rng.choice(
                ("def", "over", "class", "variantSet")[: 4 if self._strange() else 3]
            )
            number = self._rng.randrange(100)
            fields = self._some(lambda: self._field(PRIM_FIELDS), 1)
            return f'{kind} Scope "p{number}" ({fields}) {{\n{self._body(depth + 1)}}}'
        return self._property()

    def _property(self) -> str:
        kind = self._type()
        before = self._rng.choice(
            ("", "", "custom ", "uniform ", *(EDITS if self._strange() else ()))
        )
        name = self._rng.choice(
            ("x", "inputs:texture:file", "asset", "a:b", '"x"' if self._strange() else "y")
        )
        number = self._rng.randrange(1000)
        suffix = self._rng.choice(SUFFIXES) if self._strange() else ""
        fields = self._field(PROPERTY_FIELDS) if self._rng.random() < 0.3 else ""
        meta = f" (\n{fields}\n)" if fields else ""
        return (f"{before}{kind}{self._space()}{name}{number}{suffix}{self._space()}="
                f"{self._space()}{self._value(kind, 0)}{meta}")  # fmt: skip

    def _type(self) -> str:
        kind = self._rng.choice(ODD_TYPES if self._rng.random() < 0.4 else sorted(TYPES))
        return kind + self._rng.choice(("", "", "[]"))

    def _field(self, fields: frozenset[str]) -> str:
        name = self._rng.choice(ODD_FIELDS) if self._strange() else self._rng.choice(sorted(fields))
        edit = self._rng.choice(EDITS) if self._strange() else ""
        kind = FIELD_TYPES.get(name, "string")
        return f"{edit}{name}{self._space()}={self._space()}{self._value(kind, 0)}"

    def _value(self, kind: str, depth: int) -> str:
        """A value of a type, or now and then of another."""
        plain = kind.removesuffix("[]")
        if self._strange():
            plain = self._rng.choice(
                ("asset", "string", "dictionary", "rel", "float", "samples", "None")
            )
        if plain == "dictionary" and depth < DEEP:
            return self._dictionary(depth + 1)
        if plain == "samples":
            return f"{{ 0: {self._value(kind, depth)}, 1: {self._value(kind, depth)} }}"
        one = {
            "asset": lambda: self._quoted("@{}@"),
            "string": lambda: self._quoted('"{}"'),
            "token": lambda: self._quoted('"{}"'),
            "rel": lambda: self._rng.choice(("</a>", "</a/b.x>", "<../b>", "<>")),
            "pathExpression": lambda: self._quoted('"{}"'),
        }.get(plain, lambda: self._numbers(plain))
        if kind.endswith("[]"):
            return f"[{', '.join(one() for _ in range(self._rng.randrange(3)))}]"
        return one()

    def _numbers(self, kind: str) -> str:
        """Numbers in as many brackets as a type has."""
        if self._strange():
            return self._rng.choice(
                ("None", "(1, 2, 3)", "true", "((1))", "[1, 2]", "1e999", "--1")
            )
        one = self._rng.choice(("1", "0", "inf") if kind in ("double", "float") else ("1", "0"))
        digits = re.findall(r"(?<!t)\d", kind.replace("64", ""))
        if kind.startswith("quat"):
            digits = ["4"]
        if not digits:
            return one
        row = f"({', '.join([one] * int(digits[0]))})"
        square = kind.startswith(("matrix", "frame"))
        return f"({', '.join([row] * int(digits[0]))})" if square else row

    def _quoted(self, usual: str) -> str:
        form = self._rng.choice(QUOTES) if self._strange() else usual
        inside = self._rng.choice(BAIT[5:7] if usual == "@{}@" and not self._strange() else BAIT)
        return form.format(inside)

    def _dictionary(self, depth: int) -> str:
        def entry() -> str:
            kind = "dictionary" if self._rng.random() < 0.3 else self._type()
            key = self._rng.choice(("k", '"k"', '"k:l"', "manifestAssetPath"))
            return f"{kind} {key} ={self._space()}{self._value(kind, depth)}"

        return f"{{\n{self._some(entry, 3)}}}"


def drawn(rng: Random) -> bytes:
    """A layer."""
    return Layers(rng).layer().encode()
