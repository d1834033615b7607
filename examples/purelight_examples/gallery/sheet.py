"""The contact sheet: each lamp seen and lighting a wall."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from purelight_examples.gallery.shown import LampShown
from purelight_format import atomic
from purelight_format.srgb import png

COLUMNS = 3
SIDE, WIDE, GAP, CAPTION = 208, 260, 12, 26  # pixels: a picture's height, a wall's width
PAPER, INK = (24, 24, 26), (225, 222, 214)


def write(path: Path, lamps: Sequence[LampShown]) -> None:
    """Write the sheet as PNG, or as JPEG where the name ends so."""
    rows = -(-len(lamps) // COLUMNS)
    cell = (SIDE + WIDE + GAP, SIDE + CAPTION + GAP)
    sheet = Image.new(
        "RGB", (min(COLUMNS, len(lamps)) * cell[0] + GAP, rows * cell[1] + GAP), PAPER
    )
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(15)
    for k, lamp in enumerate(lamps):
        x, y = GAP + cell[0] * (k % COLUMNS), GAP + cell[1] * (k // COLUMNS)
        sheet.paste(graded(lamp, "seen").resize((SIDE, SIDE), Image.Resampling.LANCZOS), (x, y))
        wall = graded(lamp, "wall").resize((WIDE, SIDE), Image.Resampling.LANCZOS)
        sheet.paste(wall, (x + SIDE, y))
        draw.text((x, y + SIDE + 3), lamp.entry.title, INK, font)
        words = f"{lamp.lumens:,.0f} lm"
        draw.text((x + SIDE + WIDE, y + SIDE + 3), words, INK, font, anchor="ra")
    buffer = io.BytesIO()
    if path.suffix.lower() in (".jpg", ".jpeg"):
        sheet.save(buffer, "JPEG", quality=88)
    else:
        sheet.save(buffer, "PNG", optimize=True)
    atomic.write_bytes(path, buffer.getvalue())


def graded(lamp: LampShown, kind: str) -> Image.Image:
    """A picture of a lamp as it is shown."""
    image, grade = lamp.picture(kind)
    return Image.open(io.BytesIO(png(image * np.asarray(grade.gains), grade.stops))).convert("RGB")
