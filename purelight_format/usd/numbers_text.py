"""Numbers and quotations as USD text."""

from __future__ import annotations

from typing import Any

import numpy as np


def number(value: float) -> str:
    """The shortest text that reads back as the same float32."""
    return str(np.float32(value))


def tuple_text(values: Any) -> str:
    """Numbers in brackets."""
    return f"({', '.join(map(number, values))})"


def tuples(rows: np.ndarray) -> str:
    """A list of them."""
    return f"[{', '.join(tuple_text(row) for row in rows)}]"


def quoted(text: str) -> str:
    """A text between quotation marks."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
