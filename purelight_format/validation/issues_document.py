"""spec/ISSUES.md from the issues: python -m purelight_format.validation.issues_document."""

from __future__ import annotations

from purelight_format.issues import CODES, Code

HEAD = """# Issues

Generated from `purelight_format/issues.py`; do not edit. An error makes a bundle invalid, a warning
does not. A code is never reused for another meaning. `{...}` stands for what was found.

| code | severity | message | rule |
|---|---|---|---|
"""


def document() -> str:
    """Returns the text of spec/ISSUES.md."""
    return HEAD + "".join(_row(code) for code in CODES.values())


def _row(code: Code) -> str:
    message = code.message.replace("|", "\\|")
    rule = code.anchor.split("#")[1].upper()
    return f"| `{code.name}` | {code.severity.value} | {message} | [{rule}]({code.anchor}) |\n"


if __name__ == "__main__":
    print(document(), end="")
