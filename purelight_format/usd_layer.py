"""Vetting of a bundle's USD layer by its words alone, before any USD library opens it.

OpenUSD composes what a layer names, from any place the process can read; so a layer may only name
members of its own bundle, and may not compose at all.
"""

from __future__ import annotations

import codecs
import posixpath
import re
from bisect import bisect_right
from collections.abc import Container, Iterator
from typing import NamedTuple, NoReturn

from purelight_format.issues import Issue, fail, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.usd_schema import SCHEMA

HEADER = b"#usda 1.0\n"
ENDINGS = (".usd", ".usda", ".usdc", ".usdz")
COMPOSING = (b"subLayers", b"references", b"payload", b"inherits", b"specializes", b"variant",
             b"clips", b"relocates", b"expressionVariables", b"colorConfiguration")  # fmt: skip
CHUNK = 1 << 20
METADATA = 1 << 16  # Bytes from the beginning in which the layer's own metadata must end.

OPENING = re.compile(rb"""["'@#/]""")
ENDS = {
    b'"""': re.compile(rb'\\|"""'), b"'''": re.compile(rb"\\|'''"),
    b"@@@": re.compile(rb"\\@@@|@@@"),
    b'"': re.compile(rb'[\\"\n]'), b"'": re.compile(rb"[\\'\n]"), b"@": re.compile(rb"[@\n]"),
    b"#": re.compile(rb"\n"),
}  # fmt: skip
ASSET = re.compile(rb"\basset ?(\[ ?\])? [^ ]+$")  # A declaration, with single spaces.
VALUES = {b"None", b"inf", b"nan", b"e", b"E"}  # Words within a value.
APPLIED = re.compile(rb"\bapiSchemas\s*=\s*\[?\s*")


class Word(NamedTuple):
    """A quotation, an asset path or a comment: its delimiter and where it lies."""

    mark: bytes
    start: int
    end: int


def check(
    data: bytes, name: str, members: Container[str], limits: Limits = LIMITS
) -> Iterator[Issue]:
    """Checks a layer.

    Arguments:
        data: its bytes.
        name: the member it is.
        members: the names of the bundle's members.
        limits: what is accepted.

    Raises:
        FormatError: If its text cannot be read at all.
    """
    _require_text(data, name, limits)
    words = list(_words(data, name, limits))
    metadata = _metadata(data, words)
    if not re.search(r'^\s*defaultPrim\s*=\s*"\w', metadata, re.M):
        yield issue("PLX_USD_NO_DEFAULT_PRIM", name)
    if not _applies_schema(data, words):
        yield issue("PLX_USD_SCHEMA_MISSING", name)
    if not _in_metres(metadata):
        yield issue("PLX_USD_METERS_PER_UNIT", name)
    for keyword in COMPOSING:
        if _stands(data, words, keyword):
            yield issue("PLX_USD_COMPOSITION", name, word=keyword.decode())
    yield from _check_quoted(data, words, name)
    for path in paths(data, words):
        yield from _check_path(path, name, members)


def paths(data: bytes, words: list[Word]) -> Iterator[str]:
    """The asset paths of a layer."""
    for mark, start, end in words:
        if mark in (b"@", b"@@@"):
            yield data[start + len(mark) : end - len(mark)].decode()


# The text


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


def _words(data: bytes, name: str, limits: Limits) -> Iterator[Word]:
    """Quotations, asset paths and comments; what lies between them has no meaning of its own."""
    position, left = len(HEADER), limits.layer_words
    while (found := OPENING.search(data, position)) is not None:
        start, position, left = found.start(), found.end(), left - 1
        mark = _mark(data, start)
        if mark in (b"//", b"/*"):  # Comments for USD, which could hide a path from this check.
            _broken(name, start, "a comment must begin with #")
        if mark != b"/":
            position, left = _end(data, name, mark, start, left)
            yield Word(mark, start, position)
        if left < 0:
            fail("PLX_USD_TOO_COMPLEX", name, limit=limits.layer_words)


def _mark(data: bytes, start: int) -> bytes:
    """The delimiter at a place, the longest that fits."""
    three, two = data[start : start + 3], data[start : start + 2]
    return three if three in ENDS else two if two in (b"//", b"/*") else three[:1]


def _end(data: bytes, name: str, mark: bytes, start: int, left: int) -> tuple[int, int]:
    """Where a word ends, and how many words may still follow; an escape counts as one."""
    position = start + len(mark)
    while left >= 0:
        found = ENDS[mark].search(data, position)
        if found is None and mark == b"#":
            return len(data), left
        if found is None or (found[0] == b"\n" and mark != b"#"):
            _broken(name, start, "a quotation has no end")
        position = found.end()
        if found[0] == mark or mark == b"#":
            break
        position, left = position + (1 if mark != b"@@@" else 0), left - 1
    return position, left


def _broken(name: str, place: int, what: str) -> NoReturn:
    fail("PLX_USD_SYNTAX", f"{name}:byte {place}", what=what)


# Its meaning


def _metadata(data: bytes, words: list[Word]) -> str:
    """The layer's own fields: the first parenthesis, without dictionaries, lists and texts."""
    depth, text, position = 0, "", len(HEADER)
    for mark, start, end in [*words, Word(b"#", METADATA, METADATA)]:
        for character in data[position : min(start, METADATA)].decode(errors="replace"):
            if depth == 0 and not character.isspace() and character != "(":
                return ""
            depth += (character in "([{") - (character in ")]}")
            if depth == 0 and character == ")":
                return text
            text += character if depth == 1 and character != "(" else ""
        if depth == 1 and mark == b'"' and end - start < 80:
            text += '"' + re.sub(r"\W", "", data[start:end].decode(errors="replace")) + '"'
        position = end
        if position >= METADATA:
            break
    return ""


def _in_metres(metadata: str) -> bool:
    metres = re.findall(r"metersPerUnit\s*=\s*([^\s;]*)", metadata)
    axes = re.findall(r"upAxis\s*=\s*(\S*)", metadata)
    return len(metres) == 1 and bool(re.fullmatch(r"1(\.0*)?", metres[0])) and axes == ['"Z"']


def _applies_schema(data: bytes, words: list[Word]) -> bool:
    """Whether the API is in a list of applied schemas, not merely in a text."""
    inside, before = False, len(HEADER)
    for mark, start, end in words:
        gap = data[max(before, start - 80) : start]
        inside = bool(APPLIED.search(gap) and gap.rstrip().endswith((b"=", b"["))) or (
            inside and gap.strip() == b","
        )
        if inside and mark == b'"' and data[start + 1 : end - 1] == SCHEMA.encode():
            return True
        before = end
    return False


def _stands(data: bytes, words: list[Word], keyword: bytes) -> bool:
    """Whether a keyword stands in the text outside of quotations, paths and comments."""
    starts = [word.start for word in words]
    position = data.find(keyword)
    while position >= 0:
        index = bisect_right(starts, position) - 1
        if index < 0 or words[index].end <= position:
            return True
        position = data.find(keyword, words[index].end)
    return False


def _check_quoted(data: bytes, words: list[Word], name: str) -> Iterator[Issue]:
    """OpenUSD takes a quotation for an asset path where one is due."""
    inside, before = False, len(HEADER)
    gap: list[bytes] = []
    for mark, start, end in words:
        gap.append(data[before:start])
        before = end
        if mark == b"#":
            continue  # A comment parts nothing.
        inside = _is_asset(b" ".join(gap), inside)
        gap = []
        if inside and mark not in (b"@", b"@@@"):
            yield issue("PLX_USD_PATH", name, path=data[start:end][:200].decode(errors="replace"))


def _is_asset(gap: bytes, inside: bool) -> bool:
    """Whether what follows a gap is in the value of an asset, if what comes before it is or not."""
    declaration, assigned, value = gap.rpartition(b"=")
    if assigned:
        inside = bool(ASSET.search(b" ".join(declaration.rsplit(None, 4)[-4:])))
    letters = re.findall(rb"[A-Za-z]+", value[:METADATA])
    return inside and VALUES.issuperset(letters)


def _check_path(path: str, name: str, members: Container[str]) -> Iterator[Issue]:
    target = posixpath.normpath(posixpath.join(posixpath.dirname(name), path))
    if not path.startswith("./") or ".." in path.split("/") or re.search(r"[\\:\[\]]", path):
        yield issue("PLX_USD_PATH", name, path=path[:200])
    elif target == name:
        return  # The asset's own identifier.
    elif target.lower().endswith(ENDINGS):
        yield issue("PLX_USD_REFERENCES_LAYER", name, path=path[:200])
    elif target not in members:
        yield issue("PLX_USD_PATH_DANGLING", name, path=path[:200])
