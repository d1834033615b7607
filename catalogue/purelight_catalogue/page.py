"""`index.html`: the catalogue for people, one static page that needs no server."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

from purelight_catalogue.catalogue import Card
from purelight_catalogue.index import card_json
from purelight_format import atomic
from purelight_format.color import lumens_words
from purelight_format.summary import length_words
from purelight_train.runs.progress import duration

SORTED = ("name", "lumens", "metres", "bytes", "seconds")
DOWNLOADS = {  # By kind of file, what the link says
    "plux": ".plux", "usda": ".usda", "ies": ".ies", "ldt": ".ldt", "report": "training report",
    "photons_ies": "traced .ies",
}  # fmt: skip


def write_page(cards: Sequence[Card], output: Path) -> Path:
    """Write the page: a card per lamp that can be searched and sorted, then what failed and why."""
    found = [card_json(card) for card in cards]
    lamps = [one for one in found if "fault" not in one]
    failed = [one for one in found if "fault" in one]
    template = resources.files("purelight_catalogue").joinpath("page.html").read_text("utf-8")
    page = Template(template).substitute(
        title=escape(f"Lamps of {output.resolve().name}"),
        count=f"{len(lamps)} lamp{'s' * (len(lamps) != 1)}",
        cards="\n".join(map(_card, lamps)),
        failed=_failures(failed),
    )
    path = output / "index.html"
    atomic.write_bytes(path, page.encode())
    return path


def _card(lamp: Mapping[str, Any]) -> str:
    caption = lamp["verdict"].get("caption", "")
    text = " ".join((lamp["name"], lamp["title"], lamp["source"], caption)).lower()
    data = " ".join(f'data-{key}="{escape(str(lamp[key]))}"' for key in SORTED)
    rows = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in _facts(lamp).items())
    links = "".join(
        f'<a href="{quote(lamp["files"][kind])}">{words}</a>'
        for kind, words in DOWNLOADS.items()
        if kind in lamp["files"]
    )
    return (
        f'<li data-text="{escape(text)}" {data}><div class="looks">{_picture(lamp)}</div>'
        f'<div class="text"><h2>{escape(lamp["title"])}</h2>{_verdict(lamp)}<dl>{rows}</dl>'
        f'{_warnings(lamp)}<div class="files">{links}</div></div></li>'
    )


def _verdict(lamp: Mapping[str, Any]) -> str:
    """The verdict in a line, and all of it behind that."""
    if not lamp["verdict"]:
        return ""
    lines = "".join(f"<p>{escape(line)}</p>" for line in lamp["verdict"]["lines"])
    caption = escape(lamp["verdict"]["caption"])
    return f"<details><summary>{caption}</summary>{lines}</details>"


def _warnings(lamp: Mapping[str, Any]) -> str:
    """What the lamp could not have besides, and why."""
    return "".join(f'<p class="missing">not there: {escape(line)}</p>' for line in lamp["warnings"])


def _picture(lamp: Mapping[str, Any]) -> str:
    title = escape(lamp["title"])
    shown = {"picture": title, "polar": f"Luminous intensity of {title}"}
    return "".join(
        f'<img src="{quote(lamp["files"][kind])}" alt="{words}" loading="lazy">'
        for kind, words in shown.items()
        if kind in lamp["files"]
    )


def _facts(lamp: Mapping[str, Any]) -> dict[str, str]:
    traced = lamp["photons"]
    known = (
        {
            "traced": f"{traced['lumens']:,.5g} ± {traced['lumens_error']:.2g} lm of "
            f"{traced['paths']:,} photons"
        }
        if traced
        else {}
    )
    return {
        "light": lumens_words(lamp["lumens"]),
        "size": f"{length_words(lamp['metres'])} across",
        "file": f"{lamp['bytes'] / 1e6:.2f} MB, {lamp['triangles']:,} triangles",
        "made in": f"{duration(lamp['seconds'])}, {lamp['gibibytes']:.1f} GiB",
        **known,
    }


def _failures(failed: Sequence[Mapping[str, Any]]) -> str:
    if not failed:
        return ""
    rows = "".join(
        f"<li><b>{escape(one['name'])}</b> ({escape(one['source'])}): {escape(one['fault'])}</li>"
        for one in failed
    )
    return f'<section id="failed"><h2>Failed: {len(failed)}</h2><ul>{rows}</ul></section>'
