"""A page of pictures side by side with their figures, in one self-contained HTML file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from string import Template

from purelight_format import atomic
from purelight_train.report.difference import gradient


@dataclass(frozen=True)
class Shot:
    """A picture with its title and the figures under it.

    Arguments:
        scale: where the colours of a map of differences end; empty for other pictures.
    """

    title: str
    uri: str
    figures: dict[str, str] = field(default_factory=dict)
    scale: str = ""

    def html(self) -> str:
        """The picture as a figure."""
        rows = "".join(
            f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in self.figures.items()
        )
        title = escape(self.title)
        bar = _bar(self.scale) if self.scale else ""
        return (
            f'<figure><img src="{self.uri}" alt="{title}"><figcaption><b>{title}</b>'
            f"{bar}<dl>{rows}</dl></figcaption></figure>"
        )


def _bar(scale: str) -> str:
    """The colours of a map of differences, and where they end."""
    end = escape(scale)
    return (
        f'<div class="bar" style="background:{gradient()}"></div>'
        f'<div class="ends"><span>-{end}</span><span>0</span><span>+{end}</span></div>'
    )


@dataclass(frozen=True)
class Row:
    """Pictures beside each other under a heading."""

    heading: str
    text: str
    shots: Sequence[Shot]

    def html(self) -> str:
        """The row as a section."""
        shots = "".join(shot.html() for shot in self.shots)
        columns = len(self.shots)
        return (
            f"<section><h2>{escape(self.heading)}</h2><p>{escape(self.text)}</p>"
            f'<div class="row" style="--columns:{columns}">{shots}</div></section>'
        )


@dataclass(frozen=True)
class Wipe:
    """Two pictures on top of each other with a slider between them."""

    left: Shot
    right: Shot

    def html(self) -> str:
        """The pair as a section."""
        left, right = escape(self.left.title), escape(self.right.title)
        return (
            '<section class="wipe" style="--at:50%">'
            f'<img src="{self.left.uri}" alt="{left}"><img src="{self.right.uri}" alt="{right}">'
            f"<span>{left}</span><span>{right}</span>"
            '<input type="range" min="0" max="100" value="50" step="0.1" aria-label="Wipe"'
            " oninput=\"this.parentNode.style.setProperty('--at',this.value+'%')\"></section>"
        )


@dataclass(frozen=True)
class Table:
    """A table of text under a heading."""

    heading: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def html(self) -> str:
        """The table as a section."""
        head = "".join(f"<th>{escape(cell)}</th>" for cell in self.header)
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
            for row in self.rows
        )
        return (
            f"<section><h2>{escape(self.heading)}</h2>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></section>"
        )


@dataclass(frozen=True)
class Cover:
    """What the page comes to: a headline and a few sentences."""

    headline: str
    lines: Sequence[str]

    def html(self) -> str:
        """The sentences under the headline."""
        lines = "".join(f"<li>{escape(line)}</li>" for line in self.lines)
        return f'<section class="cover"><h2>{escape(self.headline)}</h2><ul>{lines}</ul></section>'


@dataclass(frozen=True)
class Link:
    """A heading, a text, and where to go from there."""

    heading: str
    text: str
    address: str
    label: str

    def html(self) -> str:
        """The link as a section."""
        link = f'<a href="{escape(self.address)}">{escape(self.label)}</a>'
        return (
            f"<section><h2>{escape(self.heading)}</h2><p>{escape(self.text)} {link}</p></section>"
        )


@dataclass(frozen=True)
class Warnings:
    """What the reader should know before anything else; nothing if there is nothing."""

    texts: Sequence[str]

    def html(self) -> str:
        """The texts as marked paragraphs."""
        return "".join(f'<p class="warning">{escape(text)}</p>' for text in self.texts)


@dataclass(frozen=True)
class Curves:
    """Curves over their common abscissa from 0 to 1, each with its own range, side by side.

    Arguments:
        curves: values by title; the last value is written beside the curve.
    """

    heading: str
    text: str
    curves: Mapping[str, Sequence[float]]

    def html(self) -> str:
        """The curves as a section."""
        shots = "".join(_curve(title, values) for title, values in self.curves.items())
        return (
            f"<section><h2>{escape(self.heading)}</h2><p>{escape(self.text)}</p>"
            f'<div class="row" style="--columns:{max(len(self.curves), 1)}">{shots}</div></section>'
        )


def _curve(title: str, values: Sequence[float]) -> str:
    """One curve as a figure with an inline drawing; what is not finite leaves a gap."""
    finite = [v for v in values if math.isfinite(v)]
    if not finite:
        return f"<figure><figcaption><b>{escape(title)}</b> no values</figcaption></figure>"
    low, high = min(finite), max(finite)
    scale, step = 80 / ((high - low) or 1.0), 200 / max(len(values) - 1, 1)
    words, pen = [], "M"
    for i, v in enumerate(values):
        if math.isfinite(v):
            words.append(f"{pen}{i * step:.1f} {90 - (v - low) * scale:.1f}")
        pen = "L" if math.isfinite(v) else "M"
    return (
        '<figure class="curve"><svg viewBox="0 0 200 100" preserveAspectRatio="none">'
        f'<path d="{" ".join(words)}" vector-effect="non-scaling-stroke"/></svg>'
        f"<figcaption><b>{escape(title)}</b><dl><div><dt>first</dt><dd>{finite[0]:.4g}</dd></div>"
        f"<div><dt>last</dt><dd>{finite[-1]:.4g}</dd></div></dl></figcaption></figure>"
    )


Section = Cover | Row | Wipe | Table | Curves | Link | Warnings


def write_page(path: Path, title: str, lead: str, sections: Sequence[Section]) -> None:
    """Write the page crash-safely; it needs no other file and no network."""
    template = Path(__file__).with_name("page.template").read_text(encoding="utf-8")
    page = Template(template).substitute(
        title=escape(title), lead=escape(lead), sections="\n".join(s.html() for s in sections)
    )
    atomic.write_bytes(path, page.encode())
