"""A lamp in a page of its own: one HTML file that opens from disk, without server or network.

The page itself is built in `web/` and lies beside this module as `page.html`.
"""

from __future__ import annotations

import base64
import gzip
import os
from html import escape
from pathlib import Path

from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError

TEMPLATE = Path(__file__).with_name("page.html")
START, END = "<!-- lamps -->", "<!-- no more lamps -->"
TITLE = "<title>PureLight</title>"
LARGEST = 200 << 20  # Bytes of a bundle; browsers hold no texts above half a gigabyte.


def page(bundle: Bundle) -> bytes:
    """The page with a lamp inside; the same bundle under the same name gives the same bytes.

    Raises:
        PureLightError: If the bundle is too large for a page.
    """
    size = len(bundle.data)
    if size > LARGEST:
        raise PureLightError(
            f"{bundle.path}: {size / 1e6:.0f} MB do not fit into a page, at most "
            f"{LARGEST / 1e6:.0f} MB do; open the file in the page instead"
        )
    before, _, rest = TEMPLATE.read_text(encoding="utf-8").partition(START)
    after = rest.partition(END)[2]
    head = before.replace(TITLE, f"<title>{escape(bundle.manifest.name)} – PureLight</title>", 1)
    return "".join([head, START, _block(bundle), END, after]).encode()


def write(path: str | Path, bundle: Bundle) -> None:
    """Writes the page.

    Raises:
        PureLightError: If the bundle is too large for a page, or the place cannot be written.
    """
    atomic.write_bytes(path, page(bundle))


def _block(bundle: Bundle) -> str:
    """The bundle as data that no browser takes for a script."""
    packed = base64.b64encode(gzip.compress(bundle.data, mtime=0)).decode()
    name = escape(os.fsencode(bundle.path.name).decode("utf-8", "replace"))
    return f'<script type="application/vnd.purelight" data-name="{name}">{packed}</script>'
