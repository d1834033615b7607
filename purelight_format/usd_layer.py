"""Vetting of a bundle's USD layer by its words alone, before any USD library opens it.

OpenUSD composes what a layer names, from any place the process can read; so a layer may only name
members of its own bundle, and no other layer.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Container, Iterator
from itertools import pairwise

from purelight_format.issues import Issue, fail, issue
from purelight_format.limits import LIMITS
from purelight_format.usd_schema import SCHEMA

ENDINGS = (".usd", ".usda", ".usdc", ".usdz")
TOKEN = re.compile(
    r"""
      (?P<comment> \#[^\n]* )
    | (?P<string>  \"{3} (?: \\. | [^\\] )*? \"{3} | '{3} (?: \\. | [^\\] )*? '{3}
                 | \" (?: \\. | [^"\\\n] )* \" | ' (?: \\. | [^'\\\n] )* ' )
    | (?P<asset>   @@@ .*? (?<!\\) @@@ | @ [^@\n]* @ )
    | (?P<other>   [^"'@\#]+ )
    """,
    re.VERBOSE | re.DOTALL,
)
METRES = re.compile(r"\bmetersPerUnit\s*=\s*1(\.0*)?\s*$", re.MULTILINE)

Tokens = list[tuple[str, str]]


def check(data: bytes, name: str, members: Container[str]) -> Iterator[Issue]:
    """Checks a layer.

    Arguments:
        data: its bytes.
        name: the member it is.
        members: the names of the bundle's members.

    Raises:
        FormatError: If its text cannot be read at all.
    """
    tokens = _tokens(data, name)
    words = "".join(text for kind, text in tokens if kind == "other")
    strings = [text[1:-1] for kind, text in tokens if kind == "string"]
    if not _assigned(tokens, "defaultPrim"):
        yield issue("PLX_USD_NO_DEFAULT_PRIM", name)
    if SCHEMA not in strings:
        yield issue("PLX_USD_SCHEMA_MISSING", name)
    if not METRES.search(words) or _assigned(tokens, "upAxis") != '"Z"':
        yield issue("PLX_USD_METERS_PER_UNIT", name)
    for kind, text in tokens:
        if kind == "asset":
            yield from _check_path(text.strip("@"), name, members)


def _tokens(data: bytes, name: str) -> Tokens:
    if len(data) > LIMITS.layer_bytes:
        fail("PLX_MEMBER_TOO_LARGE", name, size=len(data), limit=LIMITS.layer_bytes)
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        fail("PLX_USD_SYNTAX", f"{name}:byte {error.start}", what="the text is not UTF-8")
    if not text.startswith("#usda 1.0\n") or "\0" in text:
        fail("PLX_USD_SYNTAX", name, what="this is no layer of USD text")
    tokens, position = [], 0
    while position < len(text):
        match = TOKEN.match(text, position)
        if match is None:
            fail("PLX_USD_SYNTAX", f"{name}:character {position}", what="a quotation has no end")
        tokens.append((str(match.lastgroup), match[0]))
        position = match.end()
    return tokens


def _assigned(tokens: Tokens, field: str) -> str:
    """The first string that is assigned to a field, with its quotation marks."""
    ending = re.compile(rf"\b{field}\s*=\s*$")
    for (_, before), (kind, text) in pairwise(tokens):
        if kind == "string" and ending.search(before[-80:]):
            return text
    return ""


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
