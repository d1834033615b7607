"""A line of text under a picture."""

from __future__ import annotations

import io

from purelight_format.errors import PureLightError

SIZE = 13  # pixels of a letter's height, in a picture of 256
MARGIN = 5
BACKGROUND, INK = (23, 23, 26), (216, 214, 210)


def under(png: bytes, text: str) -> bytes:
    """The picture with a line of text in a dark bar below it.

    Raises:
        PureLightError: If there is no Pillow.
    """
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise PureLightError('a caption needs Pillow: pip install "purelight[onnx]"') from error
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    font = ImageFont.load_default(SIZE)
    box = font.getbbox(text)
    bar = SIZE + 2 * MARGIN
    whole = Image.new("RGB", (picture.width, picture.height + bar), BACKGROUND)
    whole.paste(picture, (0, 0))
    at = ((picture.width - (box[2] - box[0])) // 2, picture.height + MARGIN - 1)
    ImageDraw.Draw(whole).text(at, text, INK, font)
    buffer = io.BytesIO()
    whole.save(buffer, "PNG")
    return buffer.getvalue()
