"""A page of pictures side by side with their figures, in one self-contained HTML file."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from purelight_format import atomic
from purelight_onnx.picture import png

Image = NDArray[np.float64]


@dataclass(frozen=True)
class Grade:
    """How radiance becomes a picture: gains per channel, then stops of exposure."""

    gains: tuple[float, float, float]
    stops: float

    def uri(self, image: Image) -> str:
        """The graded picture as a `data:` address."""
        encoded = png(image * np.asarray(self.gains), self.stops)
        return "data:image/png;base64," + base64.b64encode(encoded).decode()


@dataclass(frozen=True)
class Shot:
    """A picture with its title and the figures under it."""

    title: str
    uri: str
    figures: dict[str, str] = field(default_factory=dict)

    def html(self) -> str:
        """The picture as a figure."""
        rows = "".join(
            f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in self.figures.items()
        )
        title = escape(self.title)
        return (
            f'<figure><img src="{self.uri}" alt="{title}"><figcaption><b>{title}</b>'
            f"<dl>{rows}</dl></figcaption></figure>"
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


def write_page(path: Path, title: str, lead: str, sections: Sequence[Row | Wipe | Table]) -> None:
    """Write the page crash-safely."""
    template = Path(__file__).with_name("report.html.template").read_text(encoding="utf-8")
    page = Template(template).substitute(
        title=escape(title), lead=escape(lead), sections="\n".join(s.html() for s in sections)
    )
    atomic.write_bytes(path, page.encode())


def heat(error: Image, white: float) -> str:
    """A relative error [H, W] as black, red, yellow, white, as a `data:` address."""
    x = np.clip(error / white, 0, 1)
    ramp = np.stack((np.clip(3 * x, 0, 1), np.clip(3 * x - 1, 0, 1), np.clip(3 * x - 2, 0, 1)), -1)
    # Undo the tone curve, so that the ramp is what one sees
    linear = -np.log1p(-0.999 * ramp**2.2) / 1.5
    return Grade((1.0, 1.0, 1.0), 0.0).uri(linear)
