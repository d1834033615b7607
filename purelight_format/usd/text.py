"""Reader of the part of USD text that a bundle's layer may use, before any USD library opens it.

A layer is read by a grammar of its own (spec/usd.md), and whatever the grammar does not name is
refused: a list of forbidden words always lacks one. Numbers in brackets are checked, not parsed.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from purelight_format.issues import fail
from purelight_format.limits import LIMITS, Limits

HEADER = b"#usda 1.0\n"
FIRST, CHUNK = 1 << 10, 1 << 20  # Bytes in which the end of brackets is looked for.
BRACKETS = 4  # Levels of brackets around numbers; a list of matrices has three.

_SIZES = [f"{kind}{size}" for kind in ("double", "float", "half", "int") for size in (2, 3, 4)]
_ROLES = [f"{role}{precision}" for precision in "dfh" for role in
          ("color3", "color4", "normal3", "point3", "quat", "texCoord2", "texCoord3",
           "vector3")]  # fmt: skip
TYPES = frozenset(
    ["asset", "bool", "double", "float", "frame4d", "half", "int", "int64", "matrix2d",
     "matrix3d", "matrix4d", "string", "timecode", "token", "uchar", "uint", "uint64",
     *_SIZES, *_ROLES])  # fmt: skip
LAYER_FIELDS = frozenset(
    ["customLayerData", "defaultPrim", "doc", "endTimeCode", "framesPerSecond",
     "kilogramsPerUnit", "metersPerUnit", "startTimeCode", "timeCodesPerSecond",
     "upAxis"])  # fmt: skip
PRIM_FIELDS = frozenset(
    ["active", "apiSchemas", "assetInfo", "customData", "displayName", "doc", "hidden",
     "kind"])  # fmt: skip
PROPERTY_FIELDS = frozenset(
    ["allowedTokens", "colorSpace", "customData", "displayGroup", "displayName", "doc",
     "elementSize", "hidden", "interpolation"])  # fmt: skip
COMPOSING = ("subLayers", "references", "payload", "inherits", "specializes", "variant", "clips",
             "relocates", "expressionVariables", "colorConfiguration")  # fmt: skip
SPECIAL = {"asset": "path", "rel": "target", "dictionary": "dictionary"}  # Values by type.
SPECIFIERS = ("def", "over", "class")

SPACE = re.compile(rb"(?:[ \t\n]+|#[^\n]*)*")
TOKEN = re.compile(
    rb"""(?P<word>[A-Za-z_][A-Za-z0-9_:]{0,255}(?![A-Za-z0-9_:]))
    |(?P<number>(?:[-+]?\.?[0-9][-+0-9.eE]{0,63}|-inf)(?![-+0-9.A-Za-z_:]))
    |(?P<text>\"\"\"[^"\\]{0,65535}\"\"\"(?!")
             |"[^"\\\x00-\x1f\x7f]{0,4095}(?:\\[ -~][^"\\\x00-\x1f\x7f]{0,4095}){0,255}"(?!"))
    |(?P<path>@[^@\x00-\x1f\x7f]{0,1023}@(?!@))
    |(?P<target><[A-Za-z0-9_:./]{0,1023}>)
    |(?P<mark>[][(){}=,;.])""",
    re.X,
)
NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
STEP = np.zeros(256, np.int8)
STEP[list(b"([")], STEP[list(b")]")] = 1, -1
IS_BRACKET = STEP != 0
NUMERIC = b"0123456789.+-eE,()[] \t\ninfa"
NO_BRACKET = bytes(set(range(256)) - set(b"()[]"))


@dataclass(frozen=True)
class Value:
    """What is assigned.

    Arguments:
        kind: "number", "word", "text", "path" or "target", or a list of such; "numbers" in
            brackets; "none" for None and empty brackets; "dictionary".
        items: as they are written, without quotation marks.
        entries: of a dictionary.
    """

    kind: str
    items: tuple[str, ...] = ()
    entries: tuple[Property, ...] = ()


@dataclass(frozen=True)
class Property:
    """An attribute, a relationship, an entry of a dictionary, or a field of metadata.

    Arguments:
        value, metadata: if there are any.
    """

    name: str
    value: Value | None = None
    metadata: tuple[Property, ...] = ()


@dataclass(frozen=True)
class Prim:
    """A prim, or the layer itself, whose name is empty."""

    name: str = ""
    metadata: list[Property] = field(default_factory=list)
    properties: list[Property] = field(default_factory=list)
    children: list[Prim] = field(default_factory=list)

    def tree(self) -> Iterator[Prim]:
        """The prim and all below it."""
        yield self
        for child in self.children:
            yield from child.tree()

    def stated(self, name: str) -> list[Value | None]:
        """What the metadata says under a name, as often as it says it."""
        return [found.value for found in self.metadata if found.name == name]


def read(data: bytes, name: str, limits: Limits = LIMITS) -> Prim:
    """Reads a layer.

    Arguments:
        data: its bytes.
        name: the member it is.
        limits: what is accepted.

    Raises:
        FormatError: With a PLX_USD code, if the text is not of the grammar.
    """
    _require_text(data, name, limits)
    return _Reader(data, name, limits).layer()


def _require_text(data: bytes, name: str, limits: Limits) -> None:
    if len(data) > limits.layer_bytes:
        fail("PLX_MEMBER_TOO_LARGE", name, size=len(data), limit=limits.layer_bytes)
    if not data.startswith(HEADER) or b"\0" in data:
        fail("PLX_USD_SYNTAX", name, what="this is no layer of USD text")
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for start in range(0, len(data), CHUNK):
            decoder.decode(data[start : start + CHUNK], start + CHUNK >= len(data))
    except UnicodeDecodeError:
        fail("PLX_USD_SYNTAX", name, what="the text is not UTF-8")


class _Reader:
    """Steps through the tokens; each is looked at once."""

    def __init__(self, data: bytes, name: str, limits: Limits) -> None:
        self._data, self._name, self._limits = data, name, limits
        self._next, self._left, self._level = len(HEADER), limits.layer_words, 0
        self._step()

    # Tokens

    def _step(self) -> None:
        """Goes on to the next token: `kind`, empty at the end, `text` and `place`."""
        found = SPACE.match(self._data, self._next)
        self.place = self._next if found is None else found.end()
        self.kind, self.text = "", ""
        if self.place == len(self._data):
            return
        self._left -= 1
        if self._left < 0:
            fail("PLX_USD_TOO_COMPLEX", self._name, limit=self._limits.layer_words)
        found = TOKEN.match(self._data, self.place)
        if found is None or found.lastgroup is None:
            self._broken("no word, number, quotation or path of the grammar")
        self.kind, self.text = found.lastgroup, found[0].decode()
        self._next = found.end()

    def _take(self, kind: str, what: str) -> str:
        """The next token, which must be of a kind."""
        if self.kind != kind:
            self._broken(f"expected {what}")
        text = self.text
        self._step()
        return text

    def _accept(self, *texts: str) -> str:
        """The next token if it is one of these words or marks, else nothing."""
        if self.kind not in ("word", "mark") or self.text not in texts:
            return ""
        text = self.text
        self._step()
        return text

    def _require(self, mark: str) -> None:
        if not self._accept(mark):
            self._broken(f"expected {mark}")

    def _broken(self, what: str) -> NoReturn:
        fail("PLX_USD_SYNTAX", f"{self._name}:byte {self.place}", what=what)

    def _refuse(self, word: str, place: int) -> NoReturn:
        """A word that the grammar does not name; one that composes is told as such."""
        for composing in COMPOSING:
            if composing in word:
                fail("PLX_USD_COMPOSITION", f"{self._name}:byte {place}", word=composing)
        fail("PLX_USD_NOT_ALLOWED", f"{self._name}:byte {place}", word=word)

    # Layer and prims

    def layer(self) -> Prim:
        prim = Prim()
        if self._accept("("):
            prim.metadata.extend(self._metadata(LAYER_FIELDS))
        while self._accept(*SPECIFIERS):
            prim.children.append(self._prim())
        if self.kind == "word":
            self._refuse(self.text, self.place)
        if self.kind:
            self._broken("expected a prim")
        return prim

    def _prim(self) -> Prim:
        """What follows def, over or class."""
        if self.kind == "word":
            self._step()  # The prim's type; unknown ones mean nothing.
        name = self._take("text", "the name of a prim")[1:-1]
        if not NAME.fullmatch(name):
            self._broken(f"{name!r} names no prim")
        prim = Prim(name)
        if self._accept("("):
            prim.metadata.extend(self._metadata(PRIM_FIELDS))
        self._require("{")
        self._enter()
        while not self._accept("}"):
            self._statement(prim)
        self._level -= 1
        return prim

    def _enter(self) -> None:
        self._level += 1
        if self._level > self._limits.layer_depth:
            fail("PLX_USD_TOO_DEEP", self._name, limit=self._limits.layer_depth)

    def _statement(self, prim: Prim) -> None:
        """A prim or a property."""
        if self._accept(*SPECIFIERS):
            prim.children.append(self._prim())
        elif not self._accept(";"):
            prim.properties.append(self._property())

    def _property(self) -> Property:
        while self._accept("custom", "uniform", "varying"):
            pass
        place, kind = self.place, self._take("word", "a property or a prim")
        if kind != "rel":
            kind = self._type(kind, place)
        place, name = self.place, self._take("word", "the name of a property")
        if self._accept("."):
            suffix = self._take("word", "connect")
            if suffix != "connect":
                self._refuse(f"{name}.{suffix}", place)
            kind = "rel"
        value = self._value(kind) if self._accept("=") else None
        metadata = self._metadata(PROPERTY_FIELDS) if self._accept("(") else ()
        return Property(name, value, tuple(metadata))

    def _type(self, word: str, place: int) -> str:
        if word not in TYPES:
            self._refuse(word, place)
        if self._accept("["):
            self._require("]")
        return word

    # Metadata and dictionaries

    def _metadata(self, fields: frozenset[str]) -> Iterator[Property]:
        while not self._accept(")"):
            if self.kind == "text" or self._accept(";"):
                if self.kind == "text":
                    self._step()  # A comment.
                continue
            self._accept("prepend", "append", "add")
            place, name = self.place, self._take("word", "a field of metadata")
            if name not in fields:
                self._refuse(name, place)
            self._require("=")
            yield Property(name, self._value(""))

    def _dictionary(self) -> Value:
        self._enter()
        entries = []
        while not self._accept("}"):
            if self._accept(";"):
                continue
            place, kind = self.place, self._take("word", "a type")
            kind = kind if kind == "dictionary" else self._type(kind, place)
            name = self.text
            self._take(self.kind if self.kind in ("word", "text") else "word", "a key")
            self._require("=")
            entries.append(Property(name, self._value(kind)))
        self._level -= 1
        return Value("dictionary", entries=tuple(entries))

    # Values

    def _value(self, kind: str) -> Value:
        """A value for a type, `rel` or `dictionary`; of any kind for a field of metadata."""
        place, value = self.place, self._any_value()
        wanted = SPECIAL.get(kind, "")
        found = value.kind if value.kind in SPECIAL.values() else ""
        if found == wanted or (not kind and found != "path"):
            return value
        if value.kind == "none" and kind != "dictionary":
            return value
        if "path" in (found, wanted):
            where, path = f"{self._name}:byte {place}", (*value.items, value.kind)[0]
            fail("PLX_USD_PATH", where, path=path[:200])
        return self._broken(f"the value of {kind} may not be a {value.kind}")

    def _any_value(self) -> Value:
        if self._accept("{"):
            return self._dictionary()
        if self.kind == "mark" and self.text in "([":
            return self._bracket()
        if self.kind not in ("word", "number", "text", "path", "target"):
            self._broken("expected a value")
        kind = "none" if (self.kind, self.text) == ("word", "None") else self.kind
        found = Value(kind, (_content(kind, self.text),))
        self._step()
        return found

    def _bracket(self) -> Value:
        """A list of texts, paths or targets, or numbers."""
        opening, self._next = self.place, self.place + 1
        if self._data[opening : opening + 1] == b"[":
            self._step()
            if self.kind in ("text", "path", "target"):
                return self._list(self.kind)
            if self._accept("]"):
                return Value("none")
        self._next = self._closing(opening)
        self._step()
        return Value("numbers")

    def _list(self, kind: str) -> Value:
        items = []
        while not self._accept("]"):
            items.append(_content(kind, self._take(kind, f"a {kind}")))
            if not self._accept(","):
                self._require("]")
                break
        return Value(kind, tuple(items))

    def _closing(self, start: int) -> int:
        """Where brackets around numbers end."""
        level, position, size = 0, start, FIRST
        while position < len(self._data):
            chunk = self._data[position : position + size]
            levels = level + np.cumsum(_steps(chunk.translate(None, NO_BRACKET)), dtype=np.int32)
            closing = int((levels == 0).argmax()) if not levels.all() else len(levels)
            end = len(chunk)
            if closing < len(levels):
                brackets = IS_BRACKET[np.frombuffer(chunk, np.uint8)]
                end = int(np.flatnonzero(brackets)[closing]) + 1
            if levels[: closing + 1].max(initial=0) > BRACKETS or chunk[:end].translate(
                None, NUMERIC
            ):
                break
            if closing < len(levels):
                return position + end
            level = int(levels[-1]) if len(levels) else level
            position, size = position + size, min(16 * size, CHUNK)
        return self._broken("brackets hold something else than numbers, or do not close")


def _steps(text: bytes) -> np.ndarray:
    """1 for every bracket that opens, -1 for one that closes, 0 for other bytes."""
    return STEP[np.frombuffer(text, np.uint8)]


def _content(kind: str, text: str) -> str:
    return text[1:-1] if kind in ("text", "path", "target") else text
