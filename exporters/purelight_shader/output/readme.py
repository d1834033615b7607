"""README.md of a folder: what is in it, and how to call it."""

from __future__ import annotations

from collections.abc import Mapping
from string import Template
from typing import Any

from purelight_shader.pages import page


def readme(about: Mapping[str, Any], title: str, pages: tuple[str, str, str], suffix: str) -> bytes:
    """The file.

    Arguments:
        about: the content of lamp.json.
        title: what the language is called.
        pages: names of those about calling the functions, about the self-test, and about buffers.
        suffix: of the files with code.
    """
    known = {
        "title": title, "digest": about["bundle"], "prefix": about["prefix"], "suffix": suffix,
        "functions": "\n".join(_functions(about)), "float_fours": about["floats"]["fours"],
        "held": _held(about), "struct": about["prefix"].title(), **about["surface"],
        **{key: about["selftest"][key] for key in ("rows", "inputs", "outputs")},
    }  # fmt: skip
    keys = ("calling", "test", "buffers")
    said = {key: _filled(name, known) for key, name in zip(keys, pages, strict=True)}
    return _filled("README.md.in", known | said).encode()


def _filled(name: str, known: Mapping[str, Any]) -> str:
    return Template(page(name)).substitute(known).rstrip("\n") + "\n"


def _held(about: Mapping[str, Any]) -> str:
    """What the buffers hold; a small lamp has none."""
    floats, integers = about["floats"]["fours"], about["integers"]["fours"]
    texts = []
    if floats:
        held = "weights, tables and other constants of all networks as float32 in fours"
        texts.append(f"`floats.bin` holds {held}\n({floats} of them)")
    if integers:
        texts.append(f"`integers.bin` holds those that are no floats, as int32 ({integers})")
    if not texts:
        return "This lamp has none: all of its constants stand in the code."
    return "; ".join(texts) + ". The code knows what lies where."


def _functions(about: Mapping[str, Any]) -> list[str]:
    lines = ["| function | takes | gives | multiply-adds |", "|---|---|---|---|"]
    for made in about["functions"]:
        given, answer = (
            ", ".join(f"{port['name']} {port['shape'] or ''}".strip() for port in made[key])
            for key in ("inputs", "outputs")
        )
        lines.append(f"| `{made['name']}` | {given} | {answer} | {made['macs']:,} |")
    return lines
