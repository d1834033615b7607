"""Pictures for shades, masks and screens, made by whole numbers alone."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zlib

import numpy as np
from PIL import Image

from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.pieces import Pixels, Textures
from benchmarks.zoo.lamps.plugin import plugin

SIDE = 128


def weave(draw: Draw) -> Pixels:
    """Threads over and under each other in two colours, as sRGB [SIDE, SIDE, 3]."""
    period = draw.pick((8, 16, 32))
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    over = ((x // period + y // period) % 2).astype(bool)
    light = np.where(over, y % period, x % period) * (80 // period)
    tone = np.array([draw.whole(120, 235) for _ in range(3)])
    return _bytes(tone[None, None] + (light[..., None] - 40))


def stripes(draw: Draw) -> Pixels:
    """Bands of two or three colours, upright or level."""
    colours = np.array([[draw.whole(40, 240) for _ in range(3)] for _ in range(draw.whole(2, 3))])
    width, across = draw.pick((8, 16, 32)), draw.chance(0.5)
    band = (np.arange(SIDE) // width) % len(colours)
    picture = np.broadcast_to(colours[band][None], (SIDE, SIDE, 3))
    return _bytes(picture if across else picture.transpose(1, 0, 2))


def holes(draw: Draw) -> Pixels:
    """A sheet's opacity: black holes in white, [SIDE, SIDE, 3]; round, slits or squares."""
    period, kind = draw.pick((16, 32)), draw.pick(("round", "slits", "squares"))
    part = draw.whole(2, 3)  # the hole's width over the period, in quarters
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    u, v = 2 * (x % period) - period + 1, 2 * (y % period) - period + 1
    reach = part * period // 4
    hole = {
        "round": u * u + v * v < reach * reach,
        "slits": (np.abs(u) < reach) & (y % (4 * period) > period // 2),
        "squares": (np.abs(u) < reach) & (np.abs(v) < reach),
    }[kind]
    return _bytes(np.repeat(np.where(hole, 0, 255)[..., None], 3, 2))


def bumps(draw: Draw) -> Pixels:
    """Heights of an uneven surface, grey [SIDE, SIDE, 3]: tents in both directions."""
    period = draw.pick((16, 32, 64))
    tent = np.abs(2 * (np.arange(SIDE) % period) - period) * (255 // period)
    return _bytes(np.repeat(((tent[:, None] + tent[None]) // 2)[..., None], 3, 2))


def screen(draw: Draw) -> Pixels:
    """A coarse picture of random colours, as a wall of LEDs shows it."""
    cells = draw.pick((4, 8))
    colour = [[[draw.whole(0, 255) for _ in range(3)] for _ in range(cells)] for _ in range(cells)]
    return _bytes(np.kron(np.array(colour), np.ones((SIDE // cells, SIDE // cells, 1))))


def bitmap(pixels: Pixels, *, raw: bool = False, repeat: int = 1) -> tuple[ET.Element, Textures]:
    """A texture and the file it reads, named by its content; `raw` values are no colours."""
    name = f"texture_{zlib.crc32(pixels.tobytes()):08x}.png"
    element = plugin("texture", "bitmap", filename=f"textures/{name}", raw=raw)
    if repeat > 1:
        scaled = ET.SubElement(element, "transform", name="to_uv")
        ET.SubElement(scaled, "scale", x=str(repeat), y=str(repeat))
    return element, {name: pixels}


def encoded(pixels: Pixels) -> bytes:
    """As PNG."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def _bytes(values: np.ndarray) -> Pixels:
    return np.clip(values, 0, 255).astype(np.uint8)
