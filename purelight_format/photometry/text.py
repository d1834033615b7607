"""Text of photometric files: encodings, line ends and numbers as they come."""

from __future__ import annotations

import codecs
import re

import numpy as np

MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"),
         (codecs.BOM_UTF16_BE, "utf-16-be"))  # fmt: skip
SEPARATORS = re.compile(r"[\s,;]+")
DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
LARGEST = 1e30


def decoded(data: bytes) -> str:
    """The text of a file of unknown encoding: byte order marks, then UTF-8, then Windows-1252."""
    for mark, encoding in MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, "replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def lines_of(data: bytes) -> list[str]:
    """Lines without their ends (any of CR, LF, CR LF), nor what DOS put after the end of a text."""
    text = decoded(data).partition("\x1a")[0]
    return [line.strip("\0 \t\f\v") for line in re.split(r"\r\n|\r|\n", text)]


def numbers(text: str, most: int) -> np.ndarray:
    """Numbers at the beginning of a text, up to `most`: [N]; they end at what is none.

    Arguments:
        text: with commas, semicolons or blanks between numbers.
    """
    found: list[float] = []
    for word in SEPARATORS.split(text):
        if not word:
            continue
        value = number(word)
        if value is None or len(found) == most:
            break
        found.append(value)
    return np.array(found)


def number(word: str) -> float | None:
    """A number of moderate size, or None."""
    if not DECIMAL.fullmatch(word) or len(word) > 64:
        return None
    value = float(word.lower().replace("d", "e"))
    return value if abs(value) <= LARGEST else None
