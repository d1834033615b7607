"""Families of lamps: each draws a lamp of about unit size, +Z up, about the origin."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.families import arms, boards, crystals, shades, shells
from benchmarks.zoo.lamps.pieces import Part

Family = Callable[[Draw], list[Part]]
FAMILIES: dict[str, Family] = {
    "globe": shells.globe,
    "vessel": shells.vessel,
    "thick globe": shells.thick_globe,
    "closed tube": shells.closed_tube,
    "open tube": shells.open_tube,
    "ring": shells.ring,
    "stack": shells.stack,
    "balls": shades.balls,
    "crystal": crystals.crystal,
    "drops": crystals.drops,
    "ice": crystals.ice,
    "lens": crystals.lens,
    "metal shade": shades.metal_shade,
    "cloth shade": shades.cloth_shade,
    "paper": shades.paper,
    "lantern": shades.lantern,
    "desk": shades.desk,
    "spotlight": shades.spotlight,
    "cone": shades.cone,
    "petals": arms.petals,
    "chandelier": arms.chandelier,
    "chain": arms.chain,
    "LED board": boards.led_board,
    "screen": boards.screen,
    "louvre": boards.louvre,
    "neon": boards.neon,
    "spiral": arms.spiral,
}
